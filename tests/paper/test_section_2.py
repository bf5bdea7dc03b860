"""Section 2, the planner (equation 1): each test is a sentence of docs/paper.md."""

import itertools

import numpy as np
import pytest
from planning_cases import optimum
from sessions import opened, play

from mjsim.values.observation import ObjectStatus
from planner.problem import RoutingProblem, Shipment


def tours(played):
    """Of every plan: the visits that had been made, and those that were planned then."""
    done = []
    for event in played.of("visit", "plan"):
        if event["event"] == "visit":
            done.append((event["kind"], event["object"]))
        else:
            yield [*done], [tuple(visit) for visit in event["visits"]]


@pytest.fixture(params=["followed", "own_way"])
def played(request):
    return request.getfixturevalue(request.param)


@pytest.mark.slow
def test_a_plan_visits_every_pickup_and_every_dropoff_once(played):
    names = [placed.name for placed in played.world.scene.episode.objects]
    every = sorted(itertools.product(("pick", "place"), names))
    for done, planned in tours(played):
        assert sorted([*done, *planned]) == every


def test_no_more_than_the_capacity_is_ever_carried(played):
    for done, planned in tours(played):
        carried = np.cumsum([1 if kind == "pick" else -1 for kind, _ in [*done, *planned]])
        assert carried.max() <= 2
        assert carried.min() >= 0


def test_a_dropoff_comes_after_its_pickup(played):
    for done, planned in tours(played):
        order = [*done, *planned]
        assert all(order.index(("pick", name)) < k for k, (kind, name) in enumerate(order) if kind == "place")


def test_what_was_done_is_the_beginning_of_every_later_plan(own_way):
    plans = list(tours(own_way))
    assert len(plans) > 2
    assert [len(done) + len(planned) for done, planned in plans] == [12] * len(plans)


@pytest.mark.parametrize("capacity", [1, 2])
@pytest.mark.parametrize("seed", [0, 1])
def test_the_plan_is_the_shortest_of_all_feasible_orders_and_open(house, capacity, seed):
    """All orders of three objects, summed over geodesics from the start to the last drop-off."""
    session, world, log = opened(house, "optimal", objects=3, seed=seed, capacity=capacity)
    session.assistant.begin(world.reset())
    plan = next(event for event in log.events if event["event"] == "plan")
    state = session.assistant.task_state(world.observation())
    places = [state.position, *state.loose.values(), *(state.deliveries[name] for name in state.loose)]
    points = [np.array(place) for place in places]
    gaps = [[house.geodesics.shortest_path(a, b).geodesic_distance for b in points] for a in points]
    shipments = tuple(Shipment(1 + k, 4 + k) for k in range(3))
    best = optimum(RoutingProblem(np.array(gaps), 0, shipments, (), capacity))
    assert plan["status"] == "optimal"
    assert plan["cost_m"] == pytest.approx(best, abs=2e-3)


def test_the_hud_shows_the_shortest_path_to_the_next_visit(followed, house):
    """From where the last visit ended: the crumbs are its points, and as many as fit into its length."""
    for event in followed.of("visit")[:-1]:
        observation, state = followed.at(event["t"] + 0.04)
        crumbs = np.array([m.position for m in state.markers if m.role == "breadcrumb"])
        walked = np.linalg.norm(np.diff(crumbs[:, :2], axis=0), axis=1)
        assert walked.max(initial=0.0) <= 0.28 + 1e-6
        step = next(item for item in state.checklist if item.current)
        goal = crumbs[-1, :2]
        shortest = house.geodesics.shortest_path(np.array(event["position"]), goal).geodesic_distance
        # The path ends at the object itself, which may lie a little off the floor where one can walk.
        assert len(crumbs) == pytest.approx(1 + shortest / 0.28, abs=2.0)
        assert step.number is not None
        assert observation.time >= event["t"]


def test_another_feasible_visit_is_replanned_for(own_way):
    """The plan after a deviation begins where the person is; after a suggested visit there is no new plan."""
    plans = {event["t"] for event in own_way.of("plan")}
    visits = own_way.of("visit")
    assert any(visit["deviated"] for visit in visits)
    for visit in visits[:-1]:
        replanned = any(0.0 <= t - visit["t"] <= 0.081 for t in plans)
        assert replanned == visit["deviated"], visit


def test_or_tools_solves_it(house):
    played = play(house, "optimal", planner="ortools", objects=2)
    assert {event["status"] for event in played.of("plan")} <= {"optimal", "feasible"}
    assert played.events[-1]["reason"] == "all delivered"


def test_reward_is_to_finish_soon(followed, own_way):
    """Who follows the shortest plan walks less than who does not."""
    assert followed.of("end")[0]["t"] < own_way.of("end")[0]["t"]


@pytest.mark.slow
def test_the_assistant_cannot_touch_the_world(house):
    """Under every condition, the same actions lead to the same states."""
    finals = set()
    for assistance in ("none", "highlight", "optimal", "guided"):
        played = play(house, assistance, user="boltzmann:0", objects=2)
        assert played.shown[-1][0].object_status == (ObjectStatus.DELIVERED,) * 2
        finals.add(tuple(played.session.record.record().recording["state_hash"].tolist()))
    assert len(finals) == 1
