"""The simulated guest: laws of each of its parts, and of whole trials."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scripted_percepts import Script, place_in, place_near, refusal
from sessions import prepared

from experiments.errors import ConfigError
from experiments.participants.base import Guidance
from experiments.participants.distribution import Distributions, draw
from experiments.participants.frontier import Frontier, SearchPlace
from experiments.participants.guest import PARAMETERS, as_behaviour
from experiments.participants.guest.decision import (
    Chooser,
    Decision,
    Known,
    Task,
    Timing,
    choose,
    first_step_costs,
)
from experiments.participants.guest.deviations import MIN_DETOUR, Adherence, Compliance, Detours, Walking
from experiments.participants.guest.model import Behaviour, Guest
from experiments.participants.guest.perception import Memory, Noticing, Perception, Recollection
from experiments.trials.setup import draw_behaviour
from experiments.trials.trial_config import TrialConfig
from hud.markers import BREADCRUMB, FLAGPOLE
from mjsim.values.actions import FollowPath, Move, Pick, Place, Wait
from planner.plan import Visit, VisitKind

FULL_COMPLIANCE = {"compliance.follows": 1.0, "compliance.quits": 0.0}
metres = st.floats(0.0, 30.0)
shares = st.floats(0.01, 1.0)


# Perception


@given(metres, metres, shares, shares)
def test_what_is_nearer_and_less_hidden_is_noticed_more_probably(a, b, one, other):
    perception = Perception(7.0, 1.0, 0.8, 4.0)
    near, far = sorted((a, b))
    hidden, open_ = sorted((one, other))
    assert perception.probability(near, one) >= perception.probability(far, one)
    assert perception.probability(a, open_) >= perception.probability(a, hidden)
    assert perception.probability(7.0, 1.0) == pytest.approx(0.5)
    assert perception.probability(a, 0.0) == 0.0, "behind a wall"


class Seen:
    """As much of a percept as noticing takes."""

    def __init__(self, distance):
        self.position, self.nearby = np.zeros(2), {}
        self.places = {f"object_{k}": np.array([distance, 0.0]) for k in range(4000)}
        self.visible_shares = dict.fromkeys(self.places, 1.0)

    def look(self):
        return self.places


@pytest.mark.parametrize("distance", [5.0, 7.0, 8.5])
def test_as_many_objects_are_noticed_as_the_law_says_however_often_one_looks(distance):
    perception = Perception(7.0, 1.0, 0.8, 4.0)
    noticing = Noticing(perception, np.random.default_rng(0))
    seen = Seen(distance)
    first, again = noticing.notice(seen), noticing.notice(seen)
    assert first == again
    assert len(first) / 4000 == pytest.approx(perception.probability(distance, 1.0), abs=0.03)
    noticing.look_afresh()
    assert set(noticing.notice(seen)) != set(first)


# Memory


@given(st.integers(0, 2**32))
def test_perfect_memory_knows_all_bins_and_none_knows_none(seed):
    bins = [f"bin_{k}" for k in range(6)]
    rng = np.random.default_rng(seed)
    assert Recollection(Memory(1.0, 300.0), bins, rng).bins == set(bins)
    assert Recollection(Memory(0.0, 300.0), bins, rng).bins == set()


def test_what_is_not_seen_again_is_forgotten_exponentially():
    known = Recollection(Memory(1.0, 100.0), [], np.random.default_rng(0))
    known.learn({f"object_{k}": np.zeros(2) for k in range(4000)}, 50.0)
    known.forget(150.0, but="object_0")
    assert len(known.objects) / 4000 == pytest.approx(math.exp(-1), abs=0.03)
    known.forget(1e9, but="object_0")
    assert list(known.objects) == ["object_0"] or not known.objects


# Decision


@given(st.lists(metres, min_size=1, max_size=8), st.integers(0, 1000))
def test_the_cheapest_is_chosen_at_temperature_zero(costs, seed):
    assert choose(costs, 0.0, np.random.default_rng(seed)) == int(np.argmin(costs))


@pytest.mark.parametrize("temperature", [0.5, 2.0])
def test_odds_of_a_choice_are_those_of_boltzmann(temperature):
    rng, costs = np.random.default_rng(0), np.array([0.0, 0.5, 2.0, np.inf])
    drawn = np.bincount([choose(costs, temperature, rng) for _ in range(8000)], minlength=4) / 8000
    expected = np.exp(-costs / temperature)
    assert np.abs(drawn - expected / expected.sum()).max() < 0.03


def line(places):
    return np.abs(np.subtract.outer(places, places)).astype(float)


def test_looking_ahead_counts_the_visits_that_follow():
    """On a line: two objects at 2 and 3 m, their bin at 1 m, the person at 0."""
    task = Task(line([0, 2, 3, 1]), picks=[1, 2], bins=[3, 3], carried=[], capacity=2)
    assert first_step_costs(task, 1) == [2.0, 3.0]
    assert first_step_costs(task, 2) == [2.0 + 1.0, 3.0 + 1.0]
    assert first_step_costs(task, 3) == [2.0 + 1.0 + 2.0, 3.0 + 1.0 + 1.0]


def test_full_hands_can_only_place():
    task = Task(line([0, 2, 1]), picks=[1], bins=[2], carried=[2, 2], capacity=2)
    assert first_step_costs(task, 2) == [math.inf, 1.0, 1.0]


ACCURATE = Decision(temperature=0.0, look_ahead=1.0, distance_error=0.0, room_cost=0.0, search_cost=0.0)


def chosen_by(house, decision, position, objects, carried=(), pull=0.0):
    """Return the choice of a guest that may also search. All objects belong in the same bin."""
    rng, names = np.random.default_rng(0), [*objects, *carried]
    percept = SimpleNamespace(
        position=position,
        hands_full=False,
        carried=carried,
        targets=dict.fromkeys(names, min(house.approaches)),
    )
    chooser = Chooser(decision, house, Frontier(house, rng), rng)
    return chooser.choose(percept, Known(objects, pull, search=True))


@pytest.mark.parametrize("pull", [0.0, 0.5, 1.0])
def test_the_nearest_object_is_fetched_and_flagpoles_let_walls_be_forgotten(house, pull):
    for seed in range(20):
        points = house.navmesh.sample(np.random.default_rng(seed), 8)
        walks, straight = house.geodesics.distances(points)[0], np.linalg.norm(points - points[0], axis=1)
        nearest = 1 + np.argmin((1 - pull) * walks[1:] + pull * straight[1:])
        objects = {f"object_{k}": point for k, point in enumerate(points) if k > 0}
        made = chosen_by(house, ACCURATE, points[0], objects, pull=pull)
        assert made == Visit(VisitKind.PICK, f"object_{nearest}")


def imagined_cost(house, decision, pull, first, position, objects, carried, targets):
    """Return the cost of a visit and of the nearest visits after it, by names of objects and bins.

    A guest whose hands are full imagines no other picks.
    """

    def leg(here, visit):
        there = (
            objects[visit.object] if visit.kind is VisitKind.PICK else house.approaches[targets[visit.object]]
        )
        walk = house.geodesics.shortest_path(here, there).geodesic_distance
        if visit.kind is VisitKind.PICK:
            walk = (1 - pull) * walk + pull * math.dist(here, there)
        is_other_room = house.rooms.room_at(here) != house.rooms.room_at(there)
        return walk + decision.room_cost * is_other_room, there

    here, held, cost, visit = position, set(carried), 0.0, first
    loose = set(objects) if len(held) < 2 else set()
    for _ in range(round(decision.look_ahead)):
        walk, here = leg(here, visit)
        cost += walk
        loose, held = loose - {visit.object}, held ^ {visit.object}
        left = [Visit(VisitKind.PLACE, name) for name in held]
        left += [Visit(VisitKind.PICK, name) for name in loose if len(held) < 2]
        if not left:
            break
        visit = min(left, key=lambda one: leg(here, one)[0])
    return cost


@pytest.mark.parametrize("seed", range(24))
def test_the_choice_is_that_of_imagined_nearest_visits(house, seed):
    rng, names = np.random.default_rng(seed), ["cup", "mug", "duck", "book"]
    points, targets = (
        house.navmesh.sample(rng, 5),
        dict(zip(names, rng.permutation(sorted(house.approaches)).tolist(), strict=False)),
    )
    carried = tuple(names[: seed % 3])
    objects = {name: points[k] for k, name in enumerate(names) if name not in carried}
    costs = {"look_ahead": 1.0 + seed % 4, "room_cost": float(rng.uniform(0.0, 4.0))}
    decision, pull = dataclasses.replace(ACCURATE, **costs), float(rng.random())
    percept = SimpleNamespace(
        position=points[4], hands_full=len(carried) == 2, carried=carried, targets=targets
    )
    chooser = Chooser(decision, house, Frontier(house, rng), rng)
    known = Known(objects, pull, search=False)
    fetchable = sorted(objects) if len(carried) < 2 else []
    visits = [Visit(VisitKind.PICK, name) for name in fetchable]
    visits += [Visit(VisitKind.PLACE, name) for name in carried]
    ranked = [
        imagined_cost(house, decision, pull, one, points[4], objects, carried, targets) for one in visits
    ]
    assert chooser._visit_costs(percept, known, fetchable) == pytest.approx(ranked)
    assert chooser.choose(percept, known) == visits[int(np.argmin(ranked))]


def test_a_costly_search_waits_until_the_hands_are_empty(house):
    position = house.viewpoints["living_room"][0]
    made = [
        chosen_by(house, dataclasses.replace(ACCURATE, search_cost=cost), position, {}, carried=("cup",))
        for cost in (0.0, 100.0)
    ]
    assert isinstance(made[0], SearchPlace)
    assert made[1] == Visit(VisitKind.PLACE, "cup")


# Compliance


def test_others_do_as_often_as_they_are_said_to():
    person = Adherence(Compliance(0.3, 0.2, 0.4, 2.0, quits=0.0), np.random.default_rng(0))
    times = range(8000)
    assert np.mean([person.follows() for _ in times]) == pytest.approx(0.3, abs=0.02)
    given_up = [person.gives_up_after(5.0) for _ in times]
    assert np.mean([after is not None for after in given_up]) == pytest.approx(0.2, abs=0.02)
    assert all(0.0 <= after <= 5.0 for after in given_up if after is not None)
    assert np.mean([person.picks_up(1.9) for _ in times]) == pytest.approx(0.4, abs=0.02)
    assert not any(person.picks_up(2.1) for _ in range(100))


def test_whoever_quits_follows_nothing_more_and_sooner_or_later_everybody_does():
    people = [
        Adherence(Compliance(1.0, 0.0, 0.0, 2.0, quits=0.1), np.random.default_rng(k)) for k in range(2000)
    ]
    followed = np.array([[person.follows() for _ in range(20)] for person in people])
    assert np.all(np.diff(followed.astype(int), axis=1) <= 0)
    assert followed.mean(axis=0) == pytest.approx(0.9 ** np.arange(1, 21), abs=0.04)


# Walking


def test_without_lapses_and_pull_a_walk_has_no_stops(house):
    ends = house.navmesh.sample(np.random.default_rng(1), 40).reshape(-1, 2, 2)
    steady = Detours(Walking(0.0, 3.0, 0.0), house, np.random.default_rng(0))
    assert not any(steady.stops(a, b, pole=True) for a, b in ends)
    pulled = Detours(Walking(0.0, 3.0, 1.0), house, np.random.default_rng(0))
    stops = [stop for a, b in ends for stop in pulled.stops(a, b, pole=True)]
    assert stops and all(np.linalg.norm(stop - house.navmesh.snap(stop)) < 0.01 for stop in stops)
    for a, b in ends:
        for stop in pulled.stops(a, b, pole=True):
            assert math.dist(stop, b) < math.dist(house.navmesh.snap(a), b) - MIN_DETOUR
            assert house.rooms.room_at(stop) == house.rooms.room_at(a) != house.rooms.room_at(b)
    assert not any(pulled.stops(a, b, pole=False) for a, b in ends)


@pytest.mark.parametrize("lapse_distance", [2.5, 6.0])
def test_lapses_lead_to_places_of_the_house_that_are_not_too_far(house, lapse_distance):
    starts = house.navmesh.sample(np.random.default_rng(2), 60)
    absent = Detours(Walking(1.0, lapse_distance, 0.0), house, np.random.default_rng(0))
    walks = [
        house.geodesics.shortest_path(start, stop).geodesic_distance
        for start in starts
        for stop in absent.stops(start, start, pole=False)
    ]
    assert len(walks) >= 55 and max(walks) <= lapse_distance and max(walks) > 0.8 * lapse_distance
    assert min(walks) > MIN_DETOUR > 0.0
    nowhere = Detours(Walking(1.0, 0.1, 0.0), house, np.random.default_rng(0))
    assert nowhere.stops(starts[0], starts[1], pole=False) == []


# Time


def test_times_are_those_of_the_sources():
    timing = Timing(1.0, 1.35, 238.0, 4.0, 6.0, 2.0)
    assert timing.choice_time(poles=False) == 1.35 and timing.choice_time(poles=True) == 3.35
    assert timing.list_time(119) == pytest.approx(120.0)
    slow = dataclasses.replace(timing, pace=2.0)
    assert slow.suggestion_time() == 2 * timing.suggestion_time() == 12.0


# People


@given(st.integers(0, 2**32))
def test_describing_one_parameter_leaves_the_others_as_they_were(seed):
    usual = draw(PARAMETERS, Distributions(), np.random.default_rng(seed), "guest")
    obedient = Distributions.of({"compliance": {"follows": 1}})
    other = draw(PARAMETERS, obedient, np.random.default_rng(seed), "guest")
    assert other == usual | {"compliance.follows": 1.0}
    assert as_behaviour(other).compliance.follows == 1.0


def test_kinds_of_people_are_as_frequent_as_described():
    drawn = [
        draw(PARAMETERS, Distributions(), np.random.default_rng(seed), "guest")["compliance.follows"]
        for seed in range(3000)
    ]
    assert np.mean(np.array(drawn) == 1.0) == pytest.approx(0.62, abs=0.03)
    assert np.mean(drawn) == pytest.approx(0.62 + 0.20 * 0.5 + 0.18 * 0.1, abs=0.02)


@pytest.mark.parametrize(
    ("user", "behaviour", "message"),
    [
        ("guest", {"compliance": {"obeys": 1}}, "'guest' has no 'compliance.obeys'; it has perception"),
        ("guest", {"compliance.follows": 1.5}, "compliance.follows must be 0 to 1 probability, got 1.5"),
        ("guest", {"timing.pace": {"mixture": [1, 2]}}, "timing.pace: Expected `array`, got `int` - at `"),
        ("guest", {"timing.pace": {"beta": [0, 2]}}, "timing.pace: the parameters of beta must be positive"),
        ("follower", {"compliance.follows": 1}, "'follower' has no 'compliance.follows'; it has no par"),
    ],
)
def test_impossible_parameters_are_named(user, behaviour, message):
    with pytest.raises(ConfigError, match=message):
        draw_behaviour(trial(user=user, behaviour=behaviour))


# Whole trials


def trial(behaviour=None, **options):
    described = Distributions.of(behaviour or {})
    settings = {"objects": 6, "assistance": "optimal", "seed": 3, "fidelity": "event", "regret": False}
    return TrialConfig(**{"user": "guest", **settings, **options, "behaviour": described})


def played(house, config):
    session, _, log = prepared(house, config)
    session.run()
    return session.record.record().recording["state_hash"].tolist(), log.events


@pytest.mark.slow
def test_who_complies_never_deviates_however_tempted_and_who_does_not_does(house):
    tempted = {"abandons": 1.0, "picks_up": 1.0, "beside": 9.0, "quits": 0.0}

    def deviations(follows, seed):
        people = {"compliance": tempted | {"follows": follows}, "perception.half_distance": 50.0}
        config = trial(people, seed=seed)
        return sum(e["deviated"] for e in played(house, config)[1] if e["event"] == "visit")

    assert [deviations(1.0, seed) for seed in range(3)] == [0, 0, 0]
    assert any(deviations(0.0, seed) for seed in range(3))


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 3])
def test_who_gives_up_the_only_object_it_knows_looks_for_others(house, seed):
    fickle = {"compliance.follows": 0.5, "compliance.abandons": 1.0, "compliance.picks_up": 0.0}
    slow_eyes = {"perception.half_distance": 3.0, "walking.lapse_rate": 0.0, "timing.pace": 1.0}
    _, events = played(house, trial(fickle | slow_eyes, seed=seed))
    assert events[-1]["reason"] == "all delivered"


@pytest.mark.parametrize("seed", [1, 3])
def test_whoever_gets_no_help_searches_place_after_place(house, seed):
    config = trial(seed=seed, objects=3, assistance="none", time_limit=300.0)
    assert played(house, config)[1][-1]["reason"] == "all delivered"


def test_whoever_looks_around_turns_once_around_on_the_spot(house):
    longest = []
    for share in (0.0, 1.0):
        config = trial({"perception.looks_around": share}, objects=3, assistance="none")
        session, _, _ = prepared(house, config)
        session.run()
        trajectory = session.record.record().trajectory
        stands = np.linalg.norm(np.diff(trajectory["position"], axis=0), axis=1) < 1e-4
        turns, turned = np.diff(np.unwrap(trajectory["heading"])), [0.0]
        for is_still, turn in zip(stands, turns, strict=True):
            turned.append(turned[-1] + turn if is_still else 0.0)
        longest.append(max(turned))
    assert longest[0] < math.pi < math.tau <= longest[1] < math.tau + 1.0


def test_guidance_takes_its_time(house):
    quick, slow = (
        played(house, trial(FULL_COMPLIANCE | {"timing.pace": 1.0, "timing.guided_step": seconds}))
        for seconds in (0.0, 6.0)
    )
    assert slow[1][-1]["t"] - quick[1][-1]["t"] == pytest.approx(12 * 6.0, abs=1.0)


def test_nobody_loses_a_path_that_is_shown(house):
    steady, absent = (
        played(house, trial(FULL_COMPLIANCE | {"walking.lapse_rate": lapses})) for lapses in (0.0, 1.0)
    )
    assert steady[0] == absent[0]


def test_the_person_is_drawn_by_its_seed_and_logged(house):
    config = trial(person_seed=7, house_seed=3, order_seed=3)
    _, events = played(house, config)
    assert events[1]["event"] == "participant"
    assert events[1]["behaviour"] == draw_behaviour(config)
    assert set(events[1]["behaviour"]) == set(PARAMETERS)
    assert draw_behaviour(config) != draw_behaviour(trial(person_seed=8, house_seed=3, order_seed=3))


# Decisions of a whole guest, from percepts that are written by hand


def guest(house, targets, position, **parts):
    """A script for a guest who sees, remembers and follows everything, unless `parts` says otherwise."""
    usual = {
        "perception": Perception(50.0, 1.0, looks_around=0.0, covers=4.0),
        "memory": Memory(1.0, 1e6),
        "decision": ACCURATE,
        "compliance": Compliance(1.0, 0.0, 0.0, 2.0, quits=0.0),
        "walking": Walking(0.0, 3.0, 0.0),
        "timing": Timing(1.0, 0.0, 1e9, 0.0, 0.0, 0.0),
    }
    return Script(Guest(house, np.random.default_rng(0), Behaviour(**{**usual, **parts})), targets, position)


def suggestion(house, start, kind, name, goal):
    path = house.geodesics.shortest_path(start, goal).points
    return Guidance(Visit(kind, name), np.vstack([path, goal]), np.array(goal), 0.4)


def test_a_slipped_object_is_searched_again_although_it_was_forgotten(house):
    """It was assumed to be in its bin until it was seen, and its place was forgotten since."""
    here, there = place_in(house, "living_room"), place_in(house, "living_room", 6)
    forgetful = {"memory": Memory(1.0, 1.0), "decision": dataclasses.replace(ACCURATE, search_cost=100.0)}
    for slips in (False, True):
        script = guest(house, dict.fromkeys(["cup", "mug"], "dish_bin"), here, **forgetful)
        assert script.aim(carried=("mug",)) == Place("mug")
        seen = {"mug": there, "cup": here + 0.5} if slips else {"cup": here + 0.5}
        assert script.aim(seen, carried=()) == Pick("cup")
        assert script.aim(carried=("cup",), seconds=1000.0) == Place("cup")
        assert script.aim(carried=()) == ("search" if slips else "none")


@pytest.mark.parametrize("refused", [False, True])
@pytest.mark.parametrize("distance", [1.0, 1.4])
@pytest.mark.parametrize("shown", ["nowhere", "in view", "flagpole"])
def test_an_object_is_given_up_if_a_grip_is_refused_near_its_place_and_it_is_not_there(
    house, refused, distance, shown
):
    place = place_in(house, "living_room")
    beside = place_near(house, place, distance)
    script = guest(house, {"cup": "dish_bin"}, place_in(house, "living_room", 5))
    assert script.aim({"cup": place}) == Pick("cup")
    answer = refusal("cup") if refused else None
    found = {"cup": place}
    aim = script.aim(
        found if shown == "in view" else (),
        position=beside, answer=answer, flagpoles=found if shown == "flagpole" else {},
    )  # fmt: skip
    gone = refused and distance < 1.2 and shown == "nowhere"
    assert aim == ("search" if gone else Pick("cup"))


@pytest.mark.parametrize("abandons", [0.0, 1.0])
def test_a_suggestion_that_is_given_up_stays_so_until_another_one_is_shown(house, abandons):
    here, cup, mug = (place_in(house, "living_room", number) for number in (0, 1, 6))
    fickle = Compliance(1.0 - 1e-12, abandons, 0.0, 2.0, quits=0.0)
    script = guest(house, dict.fromkeys(["cup", "mug"], "dish_bin"), here, compliance=fickle)
    shown = suggestion(house, here, VisitKind.PICK, "cup", cup)
    script.act({"mug": mug}, guidance=shown, shown_roles=frozenset({BREADCRUMB}))
    walk = script.act({"mug": mug}, seconds=0.1)
    assert walk.shown and walk.then == Pick("cup") and script.percept.time < walk.until < 100.0
    later = [script.act(seconds=20.0) for _ in range(3)]
    assert [(walk.shown, walk.then) for walk in later] == [
        (not abandons, Pick("mug" if abandons else "cup"))
    ] * 3
    held = later[-1].then.object
    box = suggestion(house, here, VisitKind.PLACE, held, house.approaches["dish_bin"])
    script.act(guidance=box, carried=(held,))
    walk = script.act(seconds=0.1)
    assert walk.shown and walk.then == Place(held)


@pytest.mark.parametrize(
    ("tempted", "distance", "held", "expected"),
    [(1.0, 1.9, (), "mug"), (1.0, 2.1, (), "cup"), (0.0, 1.9, (), "cup"), (1.0, 1.9, ("duck", "book"), None)],
)
def test_an_object_near_the_way_is_picked_up_by_those_who_are_tempted(
    house, tempted, distance, held, expected
):
    here, cup = place_in(house, "living_room"), place_in(house, "living_room", 1)
    script = guest(
        house, dict.fromkeys(["cup", "mug", "duck", "book"], "dish_bin"), here,
        compliance=Compliance(1.0 - 1e-12, 0.0, tempted, 2.0, quits=0.0),
    )  # fmt: skip
    kind, name = (VisitKind.PLACE, "duck") if held else (VisitKind.PICK, "cup")
    shown = suggestion(house, here, kind, name, house.approaches["dish_bin"] if held else cup)
    script.act(guidance=shown, shown_roles=frozenset({BREADCRUMB}), carried=held)
    assert script.act(seconds=0.1).shown
    walk = script.act({"mug": here + np.array([0.0, distance])})
    assert walk.then == (Place("duck") if held else Pick(expected))
    assert walk.shown == (expected != "mug")
    nearer = script.act({"mug": here + np.array([0.0, 1.0])})
    if distance < 2.0 and not tempted:
        assert nearer.then == Pick("cup"), "each object is considered once on the way"


@pytest.mark.parametrize("tempted", [0.1, 0.3])
def test_an_object_that_was_passed_is_not_considered_again_on_the_same_way(house, tempted):
    """The decision at the first sight of the object is the decision at each later sight."""
    here, cup = place_in(house, "living_room"), place_in(house, "living_room", 1)
    wavering = Compliance(1.0 - 1e-12, 0.0, tempted, 2.0, quits=0.0)
    script = guest(house, dict.fromkeys(["cup", "mug"], "dish_bin"), here, compliance=wavering)
    script.act(guidance=suggestion(house, here, VisitKind.PICK, "cup", cup))
    assert script.act(seconds=0.1).shown
    seen = {"mug": here + np.array([0.0, 1.0])}
    assert len({script.act(seen).then for _ in range(30)}) == 1


@pytest.mark.parametrize("shown", [False, True])
def test_only_shown_flagpoles_make_the_guest_forget_walls(house, shown):
    """The nearest object by walk differs from the nearest object on a straight line, behind a wall."""
    for seed in range(200):
        here, one, other = house.navmesh.sample(np.random.default_rng(seed), 3)
        walks = house.geodesics.distances(np.array([here, one, other]))[0]
        if math.dist(here, one) + 0.5 < math.dist(here, other) and walks[1] > walks[2] + 0.5:
            break
    places = {"cup": one, "mug": other}
    script = guest(house, dict.fromkeys(places, "dish_bin"), here, walking=Walking(0.0, 3.0, 1.0))
    roles = frozenset({FLAGPOLE} if shown else ())
    script.act(places, shown_roles=roles, flagpoles=places if shown else {})
    nearest = "cup" if shown else "mug"
    assert script.participant._intention.aim == Visit(VisitKind.PICK, nearest)


def test_a_guest_who_does_not_follow_may_choose_what_is_suggested_and_remembers_where_it_is(house):
    here, cup, mug = (place_in(house, "living_room", number) for number in (0, 6, 1))
    stubborn = Compliance(0.0, 0.0, 0.0, 2.0, quits=0.0)
    script = guest(house, dict.fromkeys(["cup", "mug"], "dish_bin"), here, compliance=stubborn)
    shown = suggestion(house, here, VisitKind.PICK, "cup", cup)
    script.act(guidance=shown, shown_roles=frozenset({BREADCRUMB}))
    walk = script.act(seconds=0.1)
    assert walk.then == Pick("cup") and not walk.shown
    assert script.aim(guidance=suggestion(house, here, VisitKind.PICK, "mug", mug)) == Pick("cup")


def test_flagpoles_are_looked_for_by_one_turn_before_something_else_is_done(house):
    here = place_in(house, "living_room")
    script = guest(house, {"cup": "dish_bin"}, here)
    headings = [0.0, 2.0, 4.0, 6.0, 6.4]
    turns = [script.act(shown_roles=frozenset({FLAGPOLE}), heading=heading) for heading in headings]
    assert all(isinstance(turn, Move) and turn.turn > 0.0 for turn in turns[:4])
    assert isinstance(turns[4], FollowPath) and turns[4].then is None, "nothing was found"
    assert script.aim(flagpoles={"cup": place_in(house, "office")}) == Pick("cup")


def test_a_guest_reads_the_list_and_thinks_before_each_walk(house):
    timing, here = Timing(2.0, 1.0, 240.0, 4.0, 3.0, 5.0), place_in(house, "living_room")
    targets = dict.fromkeys([f"object_{k}" for k in range(6)], "dish_bin")
    for roles, reading, deciding in (
        ((), 2.0 * 6 * 4 / 240 * 60, 2.0 * 1.0),
        ((FLAGPOLE,), 2.0 * 6 * 4 / 240 * 60, 2.0 * (1.0 + 5.0)),
        ((BREADCRUMB,), 0.0, 2.0 * 3.0),
    ):
        script = guest(house, targets, here, timing=timing)
        seen, goal = {"object_0": here + 1.0}, here + 1.0
        shown = suggestion(house, here, VisitKind.PICK, "object_0", goal) if BREADCRUMB in roles else None
        values = {"seconds": 0.0, "guidance": shown, "shown_roles": frozenset(roles)}
        if reading:
            assert script.act(seen, **values) == Wait(reading)
            values["seconds"] = reading
        assert script.act(seen, **values) == Wait(reading + deciding)
        script.act(seen, seconds=deciding, guidance=shown)
        assert script.aim(seen, seconds=0.0) == Pick("object_0")


def test_an_unknown_bin_is_found_from_a_viewpoint_of_its_room_or_from_near_by(house):
    ignorant = Memory(0.0, 1e6)
    script = guest(house, {"cup": "dish_bin"}, place_in(house, "living_room"), memory=ignorant)
    walk = script.act(carried=("cup",))
    assert walk.then is None and house.rooms.room_at(walk.goal) == "kitchen"
    turn = script.act(position=walk.goal)
    assert isinstance(turn, Move) and turn.turn > 0.0
    assert [isinstance(script.act(heading=heading), Move) for heading in (2.0, 4.0, 6.0)] == [True] * 3
    assert script.aim(heading=6.4) == Place("cup")
    for distance, is_seen in ((1.9, True), (2.1, False)):
        bin_ = house.approaches["bookshelf"]
        near = place_near(house, bin_, distance)
        script = guest(house, {"cup": "bookshelf"}, near, memory=ignorant)
        assert (script.aim(carried=("cup",)) == Place("cup")) == is_seen


def test_a_path_that_was_left_or_is_blocked_is_no_longer_followed(house):
    here, cup = place_in(house, "living_room"), place_in(house, "living_room", 1)
    shown = suggestion(house, here, VisitKind.PICK, "cup", cup)
    for position, blocked, follows in (
        (here, False, True),
        (here, True, False),
        (here - np.array([0.0, 0.8]), False, False),
    ):
        script = guest(house, {"cup": "dish_bin"}, position)
        script.act(guidance=shown, shown_roles=frozenset({BREADCRUMB}))
        walk = script.act(seconds=0.1, blocked=blocked)
        assert walk.then == Pick("cup") and walk.shown == follows
        assert script.act(seconds=0.1, blocked=False).shown == follows, "also later"


def test_a_lapse_leads_elsewhere_first_but_not_from_a_path_that_is_shown(house):
    here, cup = place_in(house, "living_room"), place_in(house, "living_room", 1)
    absent = Walking(1.0, 4.0, 0.0)
    script = guest(house, {"cup": "dish_bin"}, here, walking=absent)
    stray = script.act({"cup": cup})
    assert stray.then is None and math.dist(stray.goal, here) > 0.5
    assert script.act(position=stray.goal + np.array([0.6, 0.0])).goal == pytest.approx(stray.goal)
    assert script.aim(position=stray.goal + np.array([0.4, 0.0])) == Pick("cup")
    script = guest(house, {"cup": "dish_bin"}, here, walking=absent)
    script.act(guidance=suggestion(house, here, VisitKind.PICK, "cup", cup))
    assert script.act(seconds=0.1).shown


@pytest.mark.parametrize("looks_around", [0.0, 1.0])
def test_a_searched_place_is_left_after_a_look_around_if_the_guest_takes_one(house, looks_around):
    curious = Perception(50.0, 1.0, looks_around, covers=0.0)
    script = guest(house, {"cup": "dish_bin"}, place_in(house, "living_room"), perception=curious)
    first = script.act()
    assert first.then is None
    there = script.act(position=first.goal)
    assert isinstance(there, Move) == bool(looks_around)
    walks = [script.act(heading=heading) for heading in (2.0, 4.0, 6.0, 6.4)]
    assert walks[-1].then is None and math.dist(walks[-1].goal, first.goal) > 0.5
    assert script.aim({"cup": first.goal}) == Pick("cup"), "a search ends once something is known"
