"""Laws of the tiers of fidelity: each repeats itself to the bit, and all tell the same story."""

import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import mujoco
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mjsim.actions import IDLE, Action, EventKind, Move, Pick, Place, WorldEvent
from mjsim.episode import Episode, PlacedObject, StartPose
from mjsim.errors import ActionError, StateError
from mjsim.fidelity import kinematics
from mjsim.fidelity import trunk_contact as trunk
from mjsim.fidelity.body_state import X, Y, standing
from mjsim.fidelity.kinematics import Gait
from mjsim.fidelity.trunk_contact import Floor
from mjsim.model import avatar
from mjsim.model.catalogue import Catalogue
from mjsim.model.footprint import Footprint
from mjsim.model.scene import Scene, compose
from mjsim.observation import ObjectStatus, Observation
from mjsim.options import FIDELITIES, WorldOptions
from mjsim.person_parameters import PersonParameters
from mjsim.rollout import Rollout
from mjsim.visibility import visible_objects
from mjsim.world import World
from mjsim.world_state import WorldState

CATEGORY = {"cube": "solids", "wedge": "solids", "ball": "rounds"}
KINEMATIC = ("windows", "event")
PLACED = (("cube", 1.6, 2.4), ("wedge", 1.3, 1.5), ("ball", 2.2, 3.0))
tiers = pytest.mark.parametrize("fidelity", FIDELITIES)
kinematic_tiers = pytest.mark.parametrize("fidelity", KINEMATIC)


def furnish(
    catalogue: Catalogue, start: tuple[float, float, float], placed: Sequence[tuple[str, float, float]]
) -> Scene:
    """The small house of two rooms with objects on the floor."""
    objects, targets = [], {}
    for number, (model, x, y) in enumerate(placed):
        name, category = f"o{number}", CATEGORY[model]
        objects.append(PlacedObject(name, category, model, (x, y), (x, y, 0.0), (1.0, 0.0, 0.0, 0.0)))
        targets[name] = catalogue.categories[category].receptacle
    keys = tuple(catalogue.receptacles)
    return compose(Episode(catalogue.name, 0, StartPose(*start), tuple(objects), keys, targets), catalogue)


@pytest.fixture(scope="module")
def house(small_catalogue: Catalogue) -> Scene:
    """The small house with a cube and a wedge for the crate, and a ball for the tray."""
    return furnish(small_catalogue, (1.0, 2.0, 0.3), PLACED)


@pytest.fixture(scope="module")
def hall(small_house: Path, tmp_path_factory: pytest.TempPathFactory) -> Scene:
    """The same house without the wall between the rooms: 6 m by 4 m of free floor."""
    folder = tmp_path_factory.mktemp("hall")
    for file in small_house.iterdir():
        text = file.read_text(encoding="utf-8")
        (folder / file.name).write_text(re.sub(r".*(partition|lintel).*\n", "", text), encoding="utf-8")
    return furnish(Catalogue.load(str(folder / "catalogue.toml")), (0.5, 2.0, 0.0), ())


def world_of(scene: Scene, fidelity: str, **options: float) -> World:
    return World(scene, WorldOptions(fidelity=fidelity, **options))  # type: ignore[arg-type]


def finish(world: World) -> list[WorldEvent]:
    """Until no motion is under way, in as many calls as there are events."""
    events: list[WorldEvent] = []
    while world.busy:
        events += world.finish().events
    return events


def do(world: World, action: Pick | Place) -> list[WorldEvent]:
    step = world.step(action)
    assert step.result is not None
    assert step.result.applied, step.result
    return [*step.events, *finish(world)]


def walk_to(world: World, x: float, y: float, *, within: float = 0.03) -> None:
    """Walk straight to a point and look ahead."""
    for _ in range(400):
        o = world.observation()
        offset = np.array([x, y]) - o.position
        distance = float(np.hypot(*offset))
        if distance < within:
            return
        error = math.remainder(math.atan2(offset[1], offset[0]) - o.heading, math.tau)
        speed = min(1.4, 2.0 * distance + 0.05) * max(0.0, math.cos(error))
        world.step(Move(speed, 0.0, 4.0 * error if distance > 0.1 else 0.0))
    raise AssertionError(f"did not arrive at {x}, {y}: {world.observation().position}")


def face(world: World, x: float, y: float) -> None:
    for _ in range(100):
        o = world.observation()
        error = math.remainder(math.atan2(y - o.position[1], x - o.position[0]) - o.heading, math.tau)
        if abs(error) < 0.05:
            return
        world.step(Move(turn=4.0 * error))
    raise AssertionError("does not turn")


def fetch(world: World, name: str) -> list[WorldEvent]:
    """Walk up to an object from the middle of the room, and pick it."""
    o = world.observation()
    x, y = o.object_positions[o.object_names.index(name), :2]
    if np.hypot(*(o.position - (x, y))) > 0.8:
        walk_to(world, x + 0.65 * np.sign(1.5 - x), y, within=0.1)
    face(world, x, y)
    return do(world, Pick(name))


def same(a: Observation, b: Observation) -> bool:
    """Whether two observations are equal to the bit."""
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in a.__dataclass_fields__)


def wander(count: int, seed: int) -> np.ndarray:
    """Moves (count, 4) of somebody who changes his mind every few steps, some of them beyond all limits."""
    rng = np.random.default_rng(seed)
    plans = rng.normal(size=(count // 8 + 1, 4)) * (1.2, 0.6, 2.0, 1.0)
    return np.repeat(plans, 8, axis=0)[:count]


# --- one call is many steps ----------------------------------------------------------------------------------


def check_rows(
    rollout: Rollout, seen: list[Observation], hashes: list[int], health: list[tuple[float, ...]]
) -> None:
    assert rollout.states.times.tolist() == [o.time for o in seen]
    assert np.array_equal(rollout.states.positions, [o.position for o in seen])
    assert rollout.states.headings.tolist() == [o.heading for o in seen]
    assert rollout.states.pitches.tolist() == [o.pitch for o in seen]
    assert np.array_equal(rollout.states.object_positions, [o.object_positions for o in seen])
    assert np.array_equal(rollout.states.object_quaternions, [o.object_quaternions for o in seen])
    assert rollout.states.state_hashes.tolist() == hashes
    assert np.array_equal(rollout.states.health, health, equal_nan=True)
    assert same(rollout.observation, seen[-1])


def stepped(
    world: World, actions: Sequence[Action]
) -> tuple[list[Observation], list[int], list[tuple[float, ...]]]:
    seen, hashes, health = [], [], []
    for action in actions:
        seen.append(world.step(action).observation)
        hashes.append(world.state_hash())
        health.append(world.health_sample.row)
    return seen, hashes, health


@tiers
def test_walking_in_one_call_is_walking_step_by_step(house: Scene, fidelity: str) -> None:
    """Empty-handed, with one object, right after a motion, and with two."""
    at_once, by_steps = world_of(house, fidelity), world_of(house, fidelity)
    for seed, name in enumerate(["o0", "o1", None]):
        moves = wander(60, seed) * 0.4
        check_rows(at_once.walk(moves), *stepped(by_steps, [Move(*row) for row in moves.tolist()]))
        if name is not None:
            assert [e.kind for e in fetch(at_once, name)] == [EventKind.PICKED]
            fetch(by_steps, name)


@tiers
def test_finishing_in_one_call_is_idling_step_by_step(house: Scene, fidelity: str) -> None:
    at_once, by_steps = world_of(house, fidelity), world_of(house, fidelity)
    for world in (at_once, by_steps):
        world.step(Pick("o0"))
    rollout = at_once.finish()
    check_rows(rollout, *stepped(by_steps, [IDLE] * len(rollout)))
    assert [e.kind for e in rollout.events] == [EventKind.PICKED]
    assert not at_once.busy
    assert not by_steps.busy
    assert len(at_once.finish()) == 0


@tiers
def test_moves_are_checked(house: Scene, fidelity: str) -> None:
    world = world_of(house, fidelity)
    with pytest.raises(ActionError, match=r"shape \(n, 4\), got shape \(3,\)"):
        world.walk([1.0, 0.0, 0.0])
    with pytest.raises(ActionError, match="finite"):
        world.walk([[math.nan, 0.0, 0.0, 0.0]])
    world.step(Pick("o0"))
    with pytest.raises(ActionError, match="finish"):
        world.walk([[1.0, 0.0, 0.0, 0.0]])


def test_an_unknown_fidelity_is_refused() -> None:
    with pytest.raises(ActionError, match="full, windows, event"):
        WorldOptions(fidelity="fast")


# --- the walk ------------------------------------------------------------------------------------------------


@given(turns=st.lists(st.floats(-0.8, 0.8), min_size=6, max_size=6), left=st.floats(-0.2, 0.2))
@settings(max_examples=8, deadline=None)
def test_a_walk_without_physics_goes_where_the_physics_goes(
    hall: Scene, turns: list[float], left: float
) -> None:
    """Five metres with turns back and forth on free floor: 1 cm apart, and arriving within 1 % of the time."""
    swings = np.array([sign * turn for turn in turns for sign in (1, -1)])
    rows = np.zeros((160, 4))
    rows[:, 0], rows[:, 1] = 1.4, left
    rows[:120, 2] = np.repeat(swings, 10)
    rows[:, 3] = np.sin(np.arange(160.0))
    walks = {fidelity: world_of(hall, fidelity).walk(rows).states for fidelity in ("full", "windows")}
    full, other = walks["full"], walks["windows"]
    gone = np.cumsum(np.hypot(*np.diff(full.positions, axis=0).T))
    free = int(np.searchsorted(gone, 5.0))
    assert 80 < free < 159
    assert np.abs(full.positions - other.positions)[:free].max() < 0.01
    assert np.abs(full.headings - other.headings)[:free].max() < 0.01
    assert np.abs(full.pitches - other.pitches)[:free].max() < 0.01
    assert full.times.tolist() == other.times.tolist()
    arrivals = [
        float(np.interp(5.0, walk.positions[: free + 5, 0], walk.times[: free + 5]))
        for walk in walks.values()
    ]
    assert arrivals[0] == pytest.approx(arrivals[1], rel=0.01)


@pytest.fixture(scope="module")
def floor(house_model: mujoco.MjModel) -> Floor:
    return Floor.of(house_model, PersonParameters().body_radius)


@given(
    speed=st.floats(1.0, 8.0), agility=st.floats(1.0, 60.0), seed=st.integers(0, 2**32 - 1), start=st.integers(0, 9)
)  # fmt: skip
@settings(max_examples=40, deadline=None)
def test_nobody_walks_into_or_through_a_wall(
    house: Scene,
    floor: Floor,
    house_footprint: Footprint,
    speed: float,
    agility: float,
    seed: int,
    start: int,
) -> None:
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
        kinematics.walk(body, forward, left, turn, look, gait, floor)
        trail.append(body[[X, Y]])
    gaps = shapely.distance(obstacles, shapely.points(np.array(trail)))
    assert gaps.min() > house.person.body_radius - 1e-6
    assert not shapely.LineString(trail).intersects(obstacles)


@kinematic_tiers
def test_the_person_slides_along_a_wall(house: Scene, fidelity: str) -> None:
    world = world_of(house, fidelity)
    walk_to(world, 0.6, 0.6)
    face(world, 1.6, -0.4)
    world.walk([[1.4, 0.0, 0.0, 0.0]] * 20)
    before = world.observation().position
    after = world.walk([[1.4, 0.0, 0.0, 0.0]] * 25).observation
    assert after.position[0] - before[0] == pytest.approx(1.4 * math.cos(after.heading), abs=0.02)
    assert after.position[1] == pytest.approx(house.person.body_radius, abs=1e-6)


@given(points=st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), min_size=1, max_size=30))
@settings(max_examples=60, deadline=None)
def test_the_gap_to_an_outline_is_that_of_geometry(points: list[tuple[float, float]]) -> None:
    corners = np.array([[-0.3, -0.2], [0.4, -0.1], [0.2, 0.5], [-0.1, 0.4]])
    polygon = shapely.Polygon(corners)
    floor = Floor.of_polygons((corners,), 0.2)
    for x, y in points:
        gap, nx, ny = trunk.gap_to(x, y, floor.edges, 0, 4)
        point = shapely.Point(x, y)
        depth = polygon.exterior.distance(point)
        assert gap == pytest.approx(-depth if polygon.contains(point) else depth, abs=1e-9)
        assert math.hypot(nx, ny) == pytest.approx(1.0)


# --- the same story in every tier ----------------------------------------------------------------------------


def tidy_up(world: World) -> list[tuple[str, str]]:
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


@pytest.fixture(scope="module")
def tidied(house: Scene) -> dict[str, tuple[World, list[tuple[str, str]]]]:
    worlds = {fidelity: world_of(house, fidelity) for fidelity in FIDELITIES}
    return {fidelity: (world, tidy_up(world)) for fidelity, world in worlds.items()}


@tiers
def test_everything_is_delivered(
    house: Scene, tidied: dict[str, tuple[World, list[tuple[str, str]]]], fidelity: str
) -> None:
    world, events = tidied[fidelity]
    assert events == [
        ("picked", "o0"), ("picked", "o1"), ("placed", "o1"), ("placed", "o0"), ("picked", "o2"), ("placed", "o2"),
    ]  # fmt: skip
    o = world.observation()
    assert set(o.object_status) == {ObjectStatus.DELIVERED}
    assert o.hands == (None, None)
    for item, name in enumerate(o.object_names):
        receptacle = house.receptacles[house.episode.targets[name]]
        assert receptacle.contains(world.data.xipos[house.index.bodies[item]])
    assert len(world.health.settle_times) == 3


@kinematic_tiers
def test_it_takes_as_long_as_in_physics(
    tidied: dict[str, tuple[World, list[tuple[str, str]]]], fidelity: str
) -> None:
    real, other = tidied["full"][0].observation(), tidied[fidelity][0].observation()
    assert other.time == pytest.approx(real.time, rel=0.01)
    assert np.abs(other.object_positions - real.object_positions).max() < 0.05


SITUATIONS: list[Callable[[World], list[Action]]] = [
    lambda _: [Pick("nobody"), Pick("o2"), Place(), Place("o1"), Pick("o0"), Pick("o1"), Place(), IDLE],
    lambda world: [*do_all(world, Pick("o0")), Pick("o0"), Place("o1"), Place("nobody"), Place(), Pick("o2")],
    lambda world: [*do_all(world, Pick("o1"), Pick("o0")), Pick(), Pick("o2"), Place()],
]


def do_all(world: World, *actions: Pick | Place) -> list[Action]:
    for action in actions:
        fetch(world, str(action.object))
    return []


@pytest.mark.parametrize("situation", SITUATIONS)
def test_refusals_are_the_same(house: Scene, situation: Callable[[World], list[Action]]) -> None:
    answers = []
    for fidelity in FIDELITIES:
        world = world_of(house, fidelity)
        actions = situation(world)
        answers.append([world.step(action).result for action in actions])
    assert answers[0] == answers[1] == answers[2]
    assert any(answer is not None and not answer.applied for answer in answers[0])


@kinematic_tiers
def test_a_refusal_changes_nothing(house: Scene, fidelity: str) -> None:
    asked, idle = world_of(house, fidelity), world_of(house, fidelity)
    for world in (asked, idle):
        world.walk(wander(10, 3))
    asked.step(Pick("o2"))
    idle.step(IDLE)
    assert asked.state_hash() == idle.state_hash()
    for action in (Place(), Pick("o0"), Pick("o1")):
        refused = asked.step(action).result
        assert refused is not None
        idle.step(action if refused.applied else IDLE)  # busy from the second on
    asked.step(Move(1.4, 0.3, 2.0, 1.0))
    idle.step(IDLE)
    assert asked.state_hash() == idle.state_hash()


def test_a_full_receptacle_takes_no_more(cramped_catalogue: Catalogue) -> None:
    """Three layers of four cubes fit; what lies on top of them is not in the crate."""
    cubes = 13
    places = [("cube", 0.9 + 0.3 * (i % 4), 2.3 + 0.3 * (i // 4)) for i in range(cubes)]
    world = world_of(furnish(cramped_catalogue, (1.4, 1.9, 1.5), places), "event")
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


# --- states --------------------------------------------------------------------------------------------------


@tiers
def test_the_same_actions_lead_to_the_same_bits(house: Scene, fidelity: str) -> None:
    world, other = world_of(house, fidelity), world_of(house, fidelity)
    first = story(world)
    assert story(other) == first
    world.reset()
    assert story(world) == first
    world.walk([[0.0, 0.0, 0.1, 0.0]])
    assert world.state_hash() != first[-1]


def story(world: World) -> list[int]:
    """Hashes along a pick, a walk, another pick and a walk."""
    hashes = []
    for name, seed in (("o0", 1), ("o1", 2)):
        fetch(world, name)
        hashes.append(world.state_hash())
        hashes += world.walk(wander(40, seed) * 0.3).states.state_hashes.tolist()
    return hashes


@kinematic_tiers
def test_a_state_is_all_there_is(house: Scene, fidelity: str) -> None:
    """Without physics a world goes on as one that was never stopped, and so does another process's."""
    going, stopped = world_of(house, fidelity), world_of(house, fidelity)
    for world in (going, stopped):
        story(world)
        walk_to(world, 0.9, 3.0)
        face(world, 0.3, 3.7)
    state = stopped.state()
    other = world_of(house, fidelity)
    restored = other.restore(WorldState.from_json(state.physics.copy(), state.details_json()))
    assert same(restored, going.observation())
    assert other.state_hash() == going.state_hash()
    for action in (Place("o0"), Place("o1")):
        assert do(other, action) == do(going, action)
        assert other.state_hash() == going.state_hash()
    assert other.health == going.health
    assert other.state().hash == going.state().hash


@kinematic_tiers
def test_a_state_can_be_taken_right_after_a_motion(house: Scene, fidelity: str) -> None:
    world, other = world_of(house, fidelity), world_of(house, fidelity)
    do(world, Pick("o0"))
    other.restore(world.state())
    world.restore(world.state())
    moves = wander(50, 5) * 0.3
    assert np.array_equal(world.walk(moves).states.state_hashes, other.walk(moves).states.state_hashes)


def test_a_state_of_another_fidelity_is_refused(house: Scene) -> None:
    states = {fidelity: world_of(house, fidelity).state() for fidelity in FIDELITIES}
    for fidelity, taken in (("full", "event"), ("event", "full"), ("windows", "full")):
        world = world_of(house, fidelity)
        if (fidelity, taken) == ("windows", "full"):
            continue  # a window is open in it, for all that anybody can tell
        with pytest.raises(StateError, match="does not fit"):
            world.restore(states[taken])
    damaged = states["event"].physics.copy()
    damaged[-2:] = 1.0
    with pytest.raises(StateError, match="rings"):
        world_of(house, "event").restore(WorldState(damaged, states["event"].details))


@kinematic_tiers
def test_the_data_are_in_step(house: Scene, fidelity: str) -> None:
    """Poses of everything are those of a fresh forward pass over the same coordinates, wherever one looks."""
    world = world_of(house, fidelity)
    for name in (None, "o0", "o1"):
        if name is not None:
            fetch(world, name)
        o = world.walk(wander(30, 7) * 0.3).observation
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


@kinematic_tiers
def test_what_is_held_stays_in_the_hand(house: Scene, fidelity: str) -> None:
    world = world_of(house, fidelity)
    for name in ("o0", "o1"):
        fetch(world, name)
    hands = [world.observation().hands.index(name) for name in ("o0", "o1")]
    for _ in range(5):
        world.walk(wander(20, 11) * 0.4)
        for name, hand in zip(("o0", "o1"), hands, strict=True):
            grips = [world.data.site(f"{name}/grip_{k}").xpos for k in avatar.GRIPS]
            hand_point = world.data.site(f"avatar/{avatar.HANDS[hand]}_grip").xpos
            assert min(np.linalg.norm(hand_point - grip) for grip in grips) < 1e-9
            assert world.data.body(f"{name}/object").xmat[8] > 1 - 1e-9


def test_the_physics_goes_on_with_the_speed_of_the_walk(house: Scene) -> None:
    """A pick in the middle of a stride: the person brakes within the acceleration that walking allows."""
    world = world_of(house, "windows")
    speeds = [0.0]
    for action in [*[Move(0.9, 0.3)] * 12, Pick("o0"), *[IDLE] * 40]:
        velocity = world.step(action).observation.velocity
        speeds.append(float(np.hypot(*velocity)))
    assert max(speeds) > 0.9
    assert np.abs(np.diff(speeds)).max() <= world.control_timestep * 3.2
