"""Laws of the tiers of fidelity: each repeats itself to the bit, and all tell the same story."""

import dataclasses
import math
import re

import mujoco
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from small_worlds import do, scene_of, standing, walk_to, world_of

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.footprint import Floor
from mjsim.house.scene import avatar
from mjsim.house.sight.sight import visible_objects
from mjsim.values.actions import WAIT, EventKind, FollowPath, Move, Pick, Place, Stop, Wait
from mjsim.values.errors import StateError
from mjsim.values.observation import ObjectStatus, StepStates
from mjsim.values.options import FIDELITIES, WorldOptions
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.body.rig import HEADING, LOOK, PITCH, PITCH_RATE, TURN, TURN_RATE, VX, VY, X, Y
from mjsim.world.fidelity import kinematics, motion_planner
from mjsim.world.fidelity import trunk_contact as trunk
from mjsim.world.fidelity.kinematics import Gait
from mjsim.world.fidelity.motion_planner import MotionPlanner
from mjsim.world.state import WorldState
from mjsim.world.walking.walker import BACK_OFF

PLACED = (("cube", 1.6, 2.4), ("wedge", 1.3, 1.5), ("ball", 2.2, 3.0))
tiers = pytest.mark.parametrize("fidelity", FIDELITIES)


@pytest.fixture(scope="module")
def house(small_catalogue):
    """The small house with a cube and a wedge for the crate, and a ball for the tray."""
    return scene_of(small_catalogue, (1.0, 2.0, 0.3), *PLACED)


@pytest.fixture(scope="module")
def hall(small_house, tmp_path_factory):
    """The same house without the wall between the rooms: 6 m by 4 m of free floor."""
    folder = tmp_path_factory.mktemp("hall")
    for file in small_house.iterdir():
        text = file.read_text(encoding="utf-8")
        (folder / file.name).write_text(re.sub(r".*(partition|lintel).*\n", "", text), encoding="utf-8")
    return scene_of(Catalogue.load(str(folder / "catalogue.toml")), (0.5, 2.0, 0.0))


def settled(scene, fidelity):
    """A world whose objects have come to rest."""
    world = world_of(scene, fidelity)
    walk(world, np.zeros((60, 4)))
    return world


def walk(world, moves):
    """One control step per row: forward, left (m/s), turn and look (rad/s); the states after them."""
    seen, hashes, health = [], [], []
    for row in np.asarray(moves).tolist():
        seen.append(world.step(Move(*row)).observation)
        hashes.append(world.state_hash())
        health.append(world.health_sample.row)
    return StepStates.of(seen, hashes, health)


def face(world, x, y):
    here = world.observation().position
    walk_to(world, *here, heading=math.atan2(y - here[1], x - here[0]), within=0.1)


def fetch(world, name):
    """Walk up to an object from the middle of the room, and pick it."""
    o = world.observation()
    x, y = o.object_positions[o.object_names.index(name), :2]
    if np.hypot(*(o.position - (x, y))) > 0.8:
        walk_to(world, x + 0.65 * np.sign(1.5 - x), y, within=0.1)
    face(world, x, y)
    return do(world, Pick(name))


def same(a, b):
    """Whether two observations are equal to the bit."""
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in a.__dataclass_fields__)


def wander(count, seed):
    """Moves (count, 4) of somebody who changes his mind every few steps, some of them beyond all limits."""
    rng = np.random.default_rng(seed)
    plans = rng.normal(size=(count // 8 + 1, 4)) * (1.2, 0.6, 2.0, 1.0)
    return np.repeat(plans, 8, axis=0)[:count]


def check_steps(at_once, singly, action):
    """That an action goes through the states of its single control steps, and ends as they do."""
    step = at_once.step(action)
    taken, passed = step.steps.actions, step.steps.passed
    moves = taken if isinstance(taken, np.ndarray) else [[taken.forward, taken.left, taken.turn, taken.look]]
    assert len(moves) == len(step.steps)
    for k, row in enumerate(moves):
        last = singly.step(Move(*row))
        if passed is None or k == len(moves) - 1:
            break
        o = last.observation
        assert passed.time[k] == o.time
        assert (passed.position[k].tolist(), passed.heading[k], passed.pitch[k]) == (
            o.position.tolist(),
            o.heading,
            o.pitch,
        )
        assert np.array_equal(passed.object_position[k], o.object_positions)
        assert np.array_equal(passed.object_quaternion[k], o.object_quaternions)
        assert int(passed.state_hash[k]) == singly.state_hash()
        assert np.array_equal(passed.health[k], singly.health_sample.row, equal_nan=True)
    assert same(step.observation, last.observation)
    assert step.events == last.events
    assert at_once.state_hash() == singly.state_hash()
    return step


@tiers
def test_a_path_in_one_call_is_walked_as_step_by_step(house, fidelity):
    at_once, singly = world_of(house, fidelity), world_of(house, fidelity)
    corners = np.array([(1.0, 2.0), (1.8, 1.4), (0.8, 1.2), (0.7, 3.0)])
    for name in ("o0", "o1", None):
        path = FollowPath(corners, corners[-1], 0.1, shown=True, tolerance=2.0)
        taken = [len(check_steps(at_once, singly, path).steps)]
        while sum(taken) < 50:  # in physics, objects come to rest at first
            taken.append(len(check_steps(at_once, singly, path).steps))
        assert max(taken) > 10
        if name is not None:
            assert [e.kind for e in fetch(at_once, name)] == [EventKind.PICKED]
            fetch(singly, name)


@tiers
def test_a_path_that_is_not_shown_is_walked_to_its_end_and_in_physics_by_one_step_for_each_action(
    house, fidelity
):
    at_once, singly = settled(house, fidelity), settled(house, fidelity)
    corners = np.array([at_once.observation().position, (1.4, 1.9)])
    path, stopped, moved = FollowPath(corners, corners[-1], 0.1, shown=False), None, 0
    while stopped is not Stop.ARRIVED:
        step = check_steps(at_once, singly, path)
        assert fidelity == "event" or len(step.steps) == 1
        stopped, moved = step.stopped, moved + len(step.steps)
        assert moved < 60
    assert moved > 5
    assert math.dist(at_once.observation().position, corners[-1]) < 0.1


def test_a_walk_in_one_call_ends_with_an_event(house, monkeypatch):
    """As when an object is lost, so that the person can decide anew."""
    world, steps = settled(house, "full"), []
    step = world._tier.step

    def step_with_event(action):
        result = step(action)
        steps.append(action)
        if len(steps) == 3:
            world._tier.episode_state.report(world.observation().time, EventKind.DISLODGED, 0)
        return result

    monkeypatch.setattr(world._tier, "step", step_with_event)
    corners = np.array([world.observation().position, (2.2, 2.0)])
    done = world.step(FollowPath(corners, corners[-1], 0.05, shown=True, tolerance=2.0))
    assert (len(done.steps), len(steps), done.stopped) == (3, 3, Stop.EVENT)
    assert [event.kind for event in done.events] == [EventKind.DISLODGED]


@tiers
def test_a_walk_stops_when_it_is_due_off_its_path_or_blocked(house, fidelity):
    world = settled(house, fidelity)
    o = world.observation()
    ahead = np.array([o.position, (2.2, 2.0)])
    path = FollowPath(ahead, ahead[-1], 0.05, shown=True)
    assert (world.step(path, 5).stopped, world.observation().time) == (Stop.DUE, pytest.approx(o.time + 0.2))
    due = world.step(dataclasses.replace(path, until=o.time + 0.32))
    assert (due.stopped, due.observation.time) == (Stop.DUE, pytest.approx(o.time + 0.32))
    assert world.step(dataclasses.replace(path, stop_distance=9.0)).stopped is Stop.ARRIVED
    aside = dataclasses.replace(path, points=ahead + np.array([0.0, 0.5]))
    off = world.step(aside)
    assert (off.stopped, len(off.steps)) == (Stop.CHANGED, 1)
    wall = np.array([o.position, (1.0, -1.0)])
    into = FollowPath(wall, wall[-1], 0.1, Pick("o0"), shown=True, tolerance=9.0)
    while (step := world.step(into)).stopped is not Stop.BLOCKED:
        assert step.observation.time < 12.0
    assert world.blocked
    back = world.step(into).steps.actions
    assert back == BACK_OFF
    world.reset()
    assert not world.blocked


@tiers
def test_waiting_in_one_call_is_idling_step_by_step(house, fidelity):
    at_once, singly = world_of(house, fidelity), world_of(house, fidelity)
    for world in (at_once, singly):
        world.step(Pick("o0"))
    picked = check_steps(at_once, singly, WAIT)
    assert [e.kind for e in picked.events] == [EventKind.PICKED]
    assert picked.stopped is Stop.EVENT
    assert not at_once.busy
    assert len(check_steps(at_once, singly, WAIT).steps) == 1
    time = at_once.observation().time
    while at_once.observation().time < time + 1.0 - 1e-6:
        check_steps(at_once, singly, Wait(time + 1.0))
    assert at_once.observation().time == pytest.approx(time + 1.0)


@given(turns=st.lists(st.floats(-0.8, 0.8), min_size=6, max_size=6), left=st.floats(-0.2, 0.2))
@settings(max_examples=8, deadline=None)
def test_a_walk_without_physics_goes_where_the_physics_goes(hall, turns, left):
    """Five metres with turns back and forth on free floor: 1 cm apart, and arriving within 1 % of the time."""
    swings = np.array([sign * turn for turn in turns for sign in (1, -1)])
    rows = np.zeros((160, 4))
    rows[:, 0], rows[:, 1] = 1.4, left
    rows[:120, 2] = np.repeat(swings, 10)
    rows[:, 3] = np.sin(np.arange(160.0))
    walks = {fidelity: walk(world_of(hall, fidelity), rows) for fidelity in FIDELITIES}
    full, other = walks["full"], walks["event"]
    gone = np.cumsum(np.hypot(*np.diff(full.position, axis=0).T))
    free = int(np.searchsorted(gone, 5.0))
    assert 80 < free < 159
    assert np.abs(full.position - other.position)[:free].max() < 0.01
    assert np.abs(full.heading - other.heading)[:free].max() < 0.01
    assert np.abs(full.pitch - other.pitch)[:free].max() < 0.01
    assert full.time.tolist() == other.time.tolist()
    arrivals = [
        float(np.interp(5.0, states.position[: free + 5, 0], states.time[: free + 5]))
        for states in walks.values()
    ]
    assert arrivals[0] == pytest.approx(arrivals[1], rel=0.01)


@tiers
@pytest.mark.parametrize("at_once", [True, False])
def test_a_motion_is_reported_with_the_time_at_the_beginning_of_its_last_step(house, fidelity, at_once):
    world, reported = world_of(house, fidelity), []
    walk_to(world, 1.0, 2.4, within=0.1)
    for action in (Pick("o0"), None, Place("o0")):
        if action is None:
            walk_to(world, 0.9, 3.0)
            face(world, 0.3, 3.7)
            continue
        step = world.step(action)
        while world.busy:
            step = world.step(WAIT if at_once else Move())
        (event,) = step.events
        assert event.time == pytest.approx(step.observation.time - world.control_timestep)
        reported.append((event.kind, event.object, event.receptacle))
    assert reported == [(EventKind.PICKED, "o0", None), (EventKind.PLACED, "o0", "crate")]


@tiers
def test_the_velocity_that_is_observed_is_that_of_the_position_in_the_house(hall, fidelity):
    world = world_of(hall, fidelity)
    for _ in range(30):
        before = world.observation()
        after = world.step(Move(forward=1.0, left=0.4, turn=0.5)).observation
        change = (after.position - before.position) / (after.time - before.time)
        assert after.velocity.shape == (2,)
        assert after.velocity == pytest.approx(change, abs=0.12)
    assert np.hypot(*after.velocity) == pytest.approx(math.hypot(1.0, 0.4), abs=0.05)


@pytest.fixture(scope="module")
def floor(house_model):
    return Floor.of(house_model, PersonParameters().body_radius)


@pytest.mark.slow
@given(
    speed=st.floats(1.0, 8.0), agility=st.floats(1.0, 60.0), seed=st.integers(0, 2**32 - 1), start=st.integers(0, 9)
)  # fmt: skip
@settings(max_examples=40, deadline=None)
def test_nobody_walks_into_or_through_a_wall(house, floor, house_footprint, speed, agility, seed, start):
    """Against the outlines of the apartment as polygons of another library: never nearer than the trunk is wide."""
    obstacles = shapely.union_all([shapely.Polygon(p) for p in house_footprint.obstacles])
    gait = Gait.of(house, WorldOptions())._replace(max_speed=speed, acceleration=agility)
    rng = np.random.default_rng(start)
    x0, y0, x1, y1 = house_footprint.bounds
    free = [
        p for p in rng.uniform((x0, y0), (x1, y1), (400, 2)) if obstacles.distance(shapely.Point(p)) > 0.21
    ]
    body = standing(*free[0], heading=1.0)
    trail = [free[0]]
    for forward, left, turn, look in wander(150, seed) * (speed, speed, 1.0, 1.0):
        kinematics.command(body, forward, left, turn, look, gait)
        kinematics.advance(body, gait, floor)
        trail.append(body[[X, Y]])
    gaps = shapely.distance(obstacles, shapely.points(np.array(trail)))
    assert gaps.min() > house.person.body_radius - 1e-6
    assert not shapely.LineString(trail).intersects(obstacles)


@given(slope=st.floats(0.1, 1.0), speed=st.floats(0.1, 0.9), aside=st.floats(-0.5, 0.5))
@settings(max_examples=60, deadline=None)
def test_walls_that_meet_stop_a_person_and_never_push_one(slope, speed, aside):
    """A person who walks between two converging walls gets stuck, keeps their distance, and gains no speed."""
    wall = np.array([[0.0, 0.0], [3.0, 3.0 * slope], [3.0, 3.0 * slope + 0.5], [0.0, 0.5]])
    walls = (wall, np.ascontiguousarray((wall * (1, -1))[::-1]))
    floor, obstacles = Floor.of_polygons(walls, 0.2), shapely.MultiPolygon(map(shapely.Polygon, walls))
    body = standing(0.25 * math.hypot(1.0, slope) / slope, 0.0, heading=0.0)
    for _ in range(200):
        body[VX], body[VY] = -speed, speed * aside
        was, before = math.hypot(body[VX], body[VY]), body[[X, Y]]
        trunk.slide(body, 0.02, 0.2, floor)
        assert math.hypot(body[VX], body[VY]) <= was + 1e-9
        assert math.dist(before, body[[X, Y]]) <= 0.02 * was + 1e-9
        assert obstacles.distance(shapely.Point(body[[X, Y]])) > 0.2 - 1e-6


@given(speed=st.floats(0.1, 20.0), forward=st.booleans())
@settings(max_examples=60, deadline=None)
def test_a_long_step_is_as_long_as_any_other_and_ends_at_a_thin_wall(speed, forward):
    wall = np.array([[1.0, -2.0], [1.01, -2.0], [1.01, 2.0], [1.0, 2.0]])
    floor, body = Floor.of_polygons((wall,), 0.2), standing(0.5, 0.0, heading=0.0)
    body[VX] = speed if forward else -speed
    end = 0.5 + body[VX] * 0.04
    trunk.slide(body, 0.04, 0.2, floor)
    assert body[X] == pytest.approx(min(end, 0.8), abs=1e-6)


@given(points=st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=30))
@settings(max_examples=60, deadline=None)
def test_the_gap_to_an_outline_is_that_of_geometry(points):
    corners = np.array([[-0.3, -0.2], [0.4, -0.1], [0.2, 0.5], [-0.1, 0.4]])
    polygon = shapely.Polygon(corners)
    floor = Floor.of_polygons((corners,), 0.2)
    for x, y in points:
        gap, nx, ny = trunk.gap_to(x, y, floor.edges, 0, 4)
        point = shapely.Point(x, y)
        depth = polygon.exterior.distance(point)
        assert gap == pytest.approx(-depth if polygon.contains(point) else depth, abs=1e-9)
        assert math.hypot(nx, ny) == pytest.approx(1.0)


def tidy_up(world):
    """Bring the cube and the wedge to the crate and the ball to the tray."""
    events = []
    for name in ("o0", "o1"):
        events += fetch(world, name)
    walk_to(world, 0.9, 3.0)
    face(world, 0.3, 3.7)
    events += do(world, Place("o1")) + do(world, Place("o0"))
    events += fetch(world, "o2")
    walk_to(world, 2.0, 2.0)
    walk_to(world, 4.5, 2.0)
    walk_to(world, 5.2, 3.0)
    events += do(world, Place())
    return [(event.kind.value, event.object) for event in events]


def test_everything_is_delivered_in_as_much_time_as_in_physics(house):
    ends = []
    for fidelity in FIDELITIES:
        world = world_of(house, fidelity)
        assert tidy_up(world) == [
            ("picked", "o0"), ("picked", "o1"), ("placed", "o1"), ("placed", "o0"), ("picked", "o2"), ("placed", "o2"),
        ]  # fmt: skip
        o = world.observation()
        assert set(o.object_status) == {ObjectStatus.DELIVERED}
        assert o.hands == (None, None)
        for item, name in enumerate(o.object_names):
            receptacle = house.receptacles[house.episode.targets[name]]
            assert receptacle.contains(world.data.xipos[house.index.bodies[item]])
        assert len(world.health.settle_times) == 3
        ends.append(o)
    assert ends[1].time == pytest.approx(ends[0].time, rel=0.01)
    assert np.abs(ends[1].object_positions - ends[0].object_positions).max() < 0.05


def test_the_fall_of_an_object_moves_no_other_that_it_does_not_touch(house):
    world = world_of(house, "event")
    for name in ("o0", "o1"):
        fetch(world, name)
    walk_to(world, 0.9, 3.0)
    face(world, 0.3, 3.7)
    do(world, Place("o0"))  # all other objects come to rest
    before = world.observation()
    do(world, Place("o1"))
    after = world.observation()
    first, second, ball = (before.object_names.index(name) for name in ("o0", "o1", "o2"))
    assert after.object_status[first] is after.object_status[second] is ObjectStatus.DELIVERED
    assert (after.object_positions[ball] == before.object_positions[ball]).all()
    assert (after.object_quaternions[ball] == before.object_quaternions[ball]).all()


def motions_of(house, fidelity):
    """Return the body, and both hands in its frame, at every control step of two picks and a place after a turn."""
    world, bodies, hands = world_of(house, fidelity), [], []

    def record(action):
        world.step(action)
        while world.busy:
            o, body = world.observation(), world.body
            c, s = math.cos(o.heading), math.sin(o.heading)
            seen = np.array([world.data.site(f"avatar/{hand}_grip").xpos for hand in avatar.HANDS])
            ahead, left = (seen[:, :2] - o.position).T
            hands.append([c * ahead + s * left, c * left - s * ahead, seen[:, 2]])
            bodies.append(body)
            assert np.abs(world.hands.T - hands[-1]).max() < 0.04
            world.step(Move())

    walk(world, [[0.0, 0.0, 0.0, 0.5]] * 20)
    for name in ("o0", "o1"):
        o = world.observation()
        x, y = o.object_positions[o.object_names.index(name), :2]
        walk_to(world, x - 0.65, y, within=0.1)
        record(Pick(name))
    walk_to(world, 0.9, 3.0)
    face(world, 1.5, 2.3)
    record(Place("o0"))
    return np.array(bodies), np.array(hands)


def test_the_body_the_head_and_both_hands_move_as_in_physics_during_picks_and_places(house):
    (full, full_hands), (event, event_hands) = (motions_of(house, fidelity) for fidelity in FIDELITIES)
    assert len(event) == len(full) > 120
    assert np.abs(event_hands - full_hands).max() < 0.03
    apart = np.abs(event - full).max(axis=0)
    assert apart[[X, Y, PITCH, LOOK]].max() < 0.003
    assert apart[[HEADING, TURN, TURN_RATE]].max() < 0.03
    assert apart[PITCH_RATE] < 0.1
    assert np.ptp(event[:, LOOK]) > 0.8 and np.ptp(event[:, HEADING]) > 2.0


def test_a_full_receptacle_takes_no_more(cramped_catalogue):
    """Three layers of four cubes fit; what lies on top of them is not in the crate."""
    cubes = 13
    places = [("cube", 0.9 + 0.3 * (i % 4), 2.3 + 0.3 * (i // 4)) for i in range(cubes)]
    world = world_of(scene_of(cramped_catalogue, (1.4, 1.9, 1.5), *places), "event")
    outcomes = []
    for number in range(cubes):
        x, y = world.observation().object_positions[number, :2]
        walk_to(world, x, y - 0.6, within=0.1)
        face(world, x, y)
        assert [e.kind for e in do(world, Pick(f"o{number}"))] == [EventKind.PICKED]
        walk_to(world, 0.9, 3.0, within=0.1)
        face(world, 0.3, 3.7)
        outcomes += [event.kind for event in do(world, Place()) if event.object == f"o{number}"]
    assert outcomes[:12] == [EventKind.PLACED] * 12
    assert outcomes[12] is EventKind.PLACE_FAILED
    status = world.observation().object_status
    assert [s is ObjectStatus.DELIVERED for s in status].count(True) == 12


@tiers
def test_the_same_actions_lead_to_the_same_bits(house, fidelity):
    world, other = world_of(house, fidelity), world_of(house, fidelity)
    first = story(world)
    assert story(other) == first
    assert fidelity == "event" or world.health.max_penetration_m > 0
    world.reset()
    assert (world.health.max_penetration_m, world.health.settle_times) == (0.0, ())
    assert story(world) == first
    walk(world, [[0.0, 0.0, 0.1, 0.0]])
    assert world.state_hash() != first[-1]


def story(world):
    """Hashes along a pick, a walk, another pick and a walk."""
    hashes = []
    for name, seed in (("o0", 1), ("o1", 2)):
        fetch(world, name)
        hashes.append(world.state_hash())
        hashes += walk(world, wander(40, seed) * 0.3).state_hash.tolist()
    return hashes


@tiers
def test_a_state_is_all_there_is(house, fidelity):
    """Right after a motion, with both hands full, a fresh world continues from it as the one whose state it is.

    In physics, as that one does when it is set back to it.
    """
    going, other = world_of(house, fidelity), world_of(house, fidelity)
    for name in ("o0", "o1"):
        fetch(going, name)
    state = going.state()
    assert all(state.details.hands)
    if fidelity == "full":
        going.restore(state)
    copy = WorldState.from_json(state.physics.copy(), state.details_json())
    assert same(other.restore(copy), going.observation())
    assert other.state().hash == going.state().hash == state.hash
    for world in (going, other):
        walk(world, wander(50, 5) * 0.3)
        walk_to(world, 0.9, 3.0)
        face(world, 0.3, 3.7)
    for action in (Place("o0"), Place("o1")):
        state, fresh = going.state(), world_of(house, fidelity)
        for world in (fresh, going, other)[: 3 if fidelity == "full" else 1]:
            world.restore(state)
        assert do(fresh, action) == do(other, action) == do(going, action)
        assert fresh.state_hash() == other.state_hash() == going.state_hash(), "also after an earlier fall"
    moves = wander(150, 5)
    assert np.array_equal(walk(going, moves).state_hash, walk(other, moves).state_hash)
    assert other.health == going.health
    assert other.state().hash == going.state().hash


def test_a_state_of_another_fidelity_is_refused(house):
    states = {fidelity: world_of(house, fidelity).state() for fidelity in FIDELITIES}
    for fidelity, taken in (("full", "event"), ("event", "full")):
        world = world_of(house, fidelity)
        with pytest.raises(StateError, match="does not fit"):
            world.restore(states[taken])
    damaged = states["event"].physics.copy()
    damaged[-2:] = 1.0
    with pytest.raises(StateError, match="rings"):
        world_of(house, "event").restore(WorldState(damaged, states["event"].details))


def test_the_data_show_the_motion_that_is_in_progress(house):
    """Rendering between two steps of a pick, and between two pauses, shows the person and the objects as they are."""
    world = world_of(house, "event")
    walk_to(world, 1.0, 2.4, within=0.1)
    world.step(Pick("o0"))
    seen = []
    while world.busy:
        for action in (Wait(world.observation().time + 0.2), Move()):
            o = world.step(action).observation
            assert world.data.time == o.time
            assert np.array_equal(world.data.xpos[house.index.bodies], o.object_positions)
            assert world.data.cam(avatar.EYE).xpos == pytest.approx(o.eye, abs=1e-9)
        seen.append(o.object_positions[0])
    assert np.ptp(seen, axis=0).max() > 0.1


def test_a_motion_that_is_longer_than_its_buffer_is_planned_like_any_other(house, monkeypatch):
    """Kernels write the states of a motion into the buffer without checking its size."""
    room = MotionPlanner._room

    def checked(planner, steps):
        trajectory = room(planner, steps)
        assert len(trajectory.vectors) == len(trajectory.poses) >= trajectory.length[0] + steps
        return trajectory

    monkeypatch.setattr(MotionPlanner, "_room", checked)
    ends = []
    for capacity in (1000, 1):
        monkeypatch.setattr(motion_planner, "_INITIAL_STEPS", capacity)
        world = world_of(house, "event")
        events = [*fetch(world, "o0")]
        walk_to(world, 0.9, 3.0)
        face(world, 0.3, 3.7)
        ends.append((events + do(world, Place("o0")), world.state_hash()))
    assert ends[0] == ends[1]


def test_the_data_are_in_step(house):
    """Poses of everything are those of a fresh forward pass over the same coordinates, wherever one looks."""
    world = world_of(house, "event")
    for name in (None, "o0", "o1"):
        if name is not None:
            fetch(world, name)
        walk(world, wander(30, 7) * 0.3)
        o = world.observation()
        data = world.data
        fresh = mujoco.MjData(world.model)
        fresh.qpos[:] = data.qpos
        mujoco.mj_forward(world.model, fresh)
        assert np.array_equal(data.geom_xpos, fresh.geom_xpos)
        assert np.array_equal(data.cam_xmat, fresh.cam_xmat)
        assert np.array_equal(data.xpos[house.index.bodies], o.object_positions)
        assert data.time == o.time
        assert o.eye == pytest.approx(data.cam(avatar.EYE).xpos, abs=1e-9)
        seen = visible_objects(house, data, o.eye, o.heading, o.pitch)
        assert seen == visible_objects(house, fresh, o.eye, o.heading, o.pitch)


def test_what_is_held_stays_in_the_hand(house):
    world = world_of(house, "event")
    for name in ("o0", "o1"):
        fetch(world, name)
    hands = [world.observation().hands.index(name) for name in ("o0", "o1")]
    for _ in range(5):
        walk(world, wander(20, 11) * 0.4)
        for name, hand in zip(("o0", "o1"), hands, strict=True):
            grips = [world.data.site(f"{name}/grip_{k}").xpos for k in avatar.GRIPS]
            hand_point = world.data.site(f"avatar/{avatar.HANDS[hand]}_grip").xpos
            assert min(np.linalg.norm(hand_point - grip) for grip in grips) < 1e-9
            assert world.data.body(f"{name}/object").xmat[8] > 1 - 1e-9
