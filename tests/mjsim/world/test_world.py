"""The world: rules, determinism, walking, carrying."""

import math
from functools import partial

import mujoco
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from small_worlds import do, finish, scene_of, walk_to, world_of

from mjsim.house.scene import avatar
from mjsim.house.scene.scene import compose
from mjsim.values.actions import IDLE, EventKind, FollowPath, Move, Pick, Place, Refusal
from mjsim.values.errors import ActionError, AssetError, PhysicsError
from mjsim.values.observation import ObjectStatus
from mjsim.values.options import FIDELITIES, WorldOptions
from mjsim.world.world import World

tiers = pytest.mark.parametrize("fidelity", FIDELITIES)


@pytest.fixture
def make(small_catalogue):
    """Makes worlds in the small house: rooms west (x < 3) and east, a doorway at y 1.5 to 2.5 between them."""
    return lambda start, *placed, fidelity="full": world_of(
        scene_of(small_catalogue, start, *placed), fidelity
    )


def run(world, actions):
    return [event for action in actions for event in world.step(action).events]


def carrying_two(make):
    world = make((1.0, 1.0, 0.0), ("cube", 1.6, 1.3), ("ball", 1.6, 0.7), ("cube", 1.8, 1.0))
    assert [e.kind for e in do(world, Pick("o0")) + do(world, Pick("o1"))] == [EventKind.PICKED] * 2
    return world


def start_only(make):
    """Loose objects near, far, and near but behind the partition."""
    return make((2.6, 0.7, 0.0), ("cube", 2.2, 1.0), ("ball", 1.2, 0.7), ("cube", 3.4, 0.7))


def behind_the_wall(make):
    return make((2.6, 0.7, 0.0), ("cube", 3.4, 0.7))


def mid_pick(make):
    world = start_only(make)
    run(world, [Pick("o0"), *[IDLE] * 12])
    assert world.busy
    return world


def with_ball_at_the_crate(make):
    world = make((0.9, 3.0, 2.0), ("ball", 0.9, 2.5))
    do(world, Pick())
    return world


def delivered(make):
    world = make((0.9, 3.0, 2.0), ("cube", 0.9, 2.5))
    assert [e.kind for e in do(world, Pick()) + do(world, Place())] == [EventKind.PICKED, EventKind.PLACED]
    return world


@tiers
@pytest.mark.parametrize(
    ("situation", "action", "refusal", "object_name", "receptacle"),
    [
        (start_only, Pick("nobody"), Refusal.UNKNOWN_OBJECT, "nobody", None),
        (start_only, Pick("o1"), Refusal.OUT_OF_REACH, "o1", "tray"),
        (start_only, Pick("o2"), Refusal.OUT_OF_REACH, "o2", "crate"),
        (behind_the_wall, Pick(), Refusal.NOTHING_IN_REACH, None, None),
        (start_only, Place(), Refusal.HANDS_EMPTY, None, None),
        (mid_pick, Pick("o1"), Refusal.BUSY, "o1", None),
        (mid_pick, Place(), Refusal.BUSY, None, None),
        (carrying_two, Pick(), Refusal.HANDS_FULL, None, None),
        (carrying_two, Pick("o2"), Refusal.HANDS_FULL, "o2", "crate"),
        (carrying_two, Pick("o0"), Refusal.ALREADY_CARRIED, "o0", "crate"),
        (carrying_two, Place("o2"), Refusal.NOT_CARRIED, "o2", None),
        (carrying_two, Place("nobody"), Refusal.UNKNOWN_OBJECT, "nobody", None),
        (carrying_two, Place(), Refusal.RECEPTACLE_OUT_OF_REACH, "o0", "crate"),
        (with_ball_at_the_crate, Place(), Refusal.NOT_THE_RECEPTACLE, "o0", "crate"),
        (delivered, Pick("o0"), Refusal.ALREADY_DELIVERED, "o0", "crate"),
        (delivered, Pick(), Refusal.NOTHING_IN_REACH, None, None),
    ],
)
def test_a_refusal_changes_nothing(make, fidelity, situation, action, refusal, object_name, receptacle):
    make = partial(make, fidelity=fidelity)
    asked, idle = situation(make), situation(make)
    answer = asked.answer(action)
    step = asked.step(action)
    assert step.result == answer
    assert (step.result.refusal, step.result.object, step.result.receptacle) == (
        refusal, object_name, receptacle,
    )  # fmt: skip
    idle.step(IDLE)
    assert asked.state_hash() == idle.state_hash()
    run(asked, [IDLE] * 10)
    run(idle, [IDLE] * 10)
    assert asked.state_hash() == idle.state_hash()


@tiers
def test_a_move_while_busy_is_ignored(make, fidelity):
    make = partial(make, fidelity=fidelity)
    asked, idle = mid_pick(make), mid_pick(make)
    asked.step(Move(1.4, 0.3, 2.0, 1.0))
    idle.step(IDLE)
    assert asked.state_hash() == idle.state_hash()


def test_the_nearest_object_is_picked_by_the_hand_on_its_side(make):
    world = make((1.0, 1.0, 0.0), ("cube", 1.5, 1.45), ("cube", 1.6, 0.75))
    result = world.step(Pick()).result
    assert result is not None and result.object == "o1"  # 0.65 m away, the other 0.67 m
    assert [(e.kind, e.object) for e in finish(world)] == [(EventKind.PICKED, "o1")]
    o = world.observation()
    assert o.hands == (None, "o1")
    assert o.object_status == (ObjectStatus.LOOSE, ObjectStatus.CARRIED)
    assert o.object_positions[1, 2] > 0.9
    do(world, Pick())
    assert world.observation().hands == ("o0", "o1")


@pytest.mark.parametrize("bearing", [0.0, 1.5, 3.1, -2.2])
def test_an_object_anywhere_around_the_person_can_be_picked(make, bearing):
    world = make((1.5, 2.0, 0.6), ("wedge", 1.5 + 0.95 * math.cos(bearing), 2 + 0.95 * math.sin(bearing)))
    assert [e.kind for e in do(world, Pick())] == [EventKind.PICKED]
    assert np.hypot(*(world.observation().position - (1.5, 2.0))) < 0.05


def test_a_fallen_object_is_picked_and_righted(make):
    world = make((1.5, 2.0, 0.0), ("wedge", 2.1, 2.0))
    address = int(world.scene.index.qpos[0])
    world.data.qpos[address : address + 7] = (2.1, 2.0, 0.1, math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
    run(world, [IDLE] * 25)
    assert [e.kind for e in do(world, Pick())] == [EventKind.PICKED]
    run(world, [IDLE] * 10)
    assert world.data.xmat[world.scene.index.bodies[0], 8] > 0.99


@pytest.mark.parametrize("doorway", [1.78, 2.0, 2.22])
def test_two_objects_are_carried_through_a_doorway(make, doorway):
    """At 0.28 m from the frame, where the navmesh allows to walk, the hands have to draw in."""
    world = carrying_two(make)
    events = walk_to(world, 2.2, doorway) + walk_to(world, 3.9, doorway) + walk_to(world, 4.5, 1.0)
    assert events == []
    assert world.observation().carried == ("o0", "o1")
    assert world.health.max_weld_error_m < 0.009
    assert world.health.max_penetration_m < 0.01


def test_walking_into_a_wall_with_full_hands_keeps_them_full(make):
    world = carrying_two(make)
    for heading in (0.0, math.pi / 2, math.pi, -math.pi / 2):
        walk_to(world, 1.5, 2.0, heading=heading)
        assert run(world, [Move(forward=1.4)] * 70) == []
    assert len(world.observation().carried) == 2


def test_a_pulled_object_slips_out_of_the_hand(make):
    world = make((1.5, 2.0, 0.0), ("cube", 2.1, 2.0))
    do(world, Pick())
    body = int(world.scene.index.bodies[0])
    world.data.xfrc_applied[body, :3] = (0.0, 0.0, -100.0)
    events = []
    while not events and world.data.time < 10.0:
        events = run(world, [IDLE])
    world.data.xfrc_applied[:] = 0.0
    assert [(e.kind, e.object) for e in events] == [(EventKind.GRIP_LOST, "o0")]
    run(world, [IDLE] * 40)
    o = world.observation()
    assert o.hands == (None, None)
    assert o.object_status == (ObjectStatus.LOOSE,)
    assert o.object_positions[0, 2] < 0.2


def test_the_person_walks_and_looks_where_it_is_told(make):
    """How fast, tests of the person's numbers say."""
    world = make((0.8, 2.0, 0.5))
    run(world, [Move(forward=9.0)] * 25)
    o = world.observation()
    assert math.atan2(o.velocity[1], o.velocity[0]) == pytest.approx(0.5, abs=1e-3)
    run(world, [Move(look=1.0)] * 100)
    o = world.observation()
    assert o.pitch == pytest.approx(avatar.PITCH_RANGE[1], abs=0.01)
    assert o.eye == pytest.approx(world.data.cam(avatar.EYE).xpos, abs=0.02)


@pytest.mark.parametrize("heading", np.linspace(-math.pi, math.pi, 9)[:-1])
def test_walls_stop_and_let_slide_but_never_let_through(make, heading):
    world = make((1.5, 1.0, float(heading)))
    trail = [world.step(Move(forward=1.4)).observation.position for _ in range(100)]
    margin = world.scene.person.body_radius - 0.04
    for x, y in trail:
        assert margin < y < 4.0 - margin
        assert margin < x
        assert x < 3.0 - 0.05 - margin or 1.5 < y < 2.5 or x > 3.05 + margin


@tiers
def test_the_person_slides_along_a_wall(make, fidelity):
    world = make((0.6, 0.4, -math.pi / 4), fidelity=fidelity)
    run(world, [Move(forward=1.4)] * 20)
    before = world.observation().position
    run(world, [Move(forward=1.4)] * 25)
    gone = world.observation().position - before
    slack = {"full": 0.05, "event": 0.02}[fidelity]
    assert gone[0] == pytest.approx(1.4 * math.sqrt(0.5), abs=slack)  # a second along the wall, unbraked
    assert abs(gone[1]) < 0.01
    if fidelity == "event":
        assert before[1] == pytest.approx(world.scene.person.body_radius, abs=1e-6)


def test_light_things_are_pushed_not_launched(make):
    world = make((0.6, 2.0, 0.0), ("cube", 1.4, 2.02), ("ball", 1.9, 1.95), ("wedge", 1.6, 2.1))
    fastest, highest = 0.0, 0.0
    for _ in range(60):
        o = world.step(Move(forward=1.4)).observation
        linear = world.data.qvel[world.scene.index.dofs[:, None] + np.arange(3)]
        fastest = max(fastest, float(np.linalg.norm(linear, axis=1).max()))
        highest = max(highest, float(o.object_positions[:, 2].max()))
    assert world.observation().position[0] > 3.0  # it did not stop the person
    assert 1.0 < fastest < 4.0  # a ball is kicked ahead
    assert highest < 0.2


def test_an_object_knocked_out_of_its_receptacle_is_loose_again(make):
    world = delivered(make)
    address = int(world.scene.index.qpos[0])
    world.data.qpos[address : address + 3] = (1.5, 2.0, 0.3)
    events = run(world, [IDLE] * 25)
    assert [(e.kind, e.object, e.receptacle) for e in events] == [
        (EventKind.TUNNELLED, "o0", None),  # this hand reaches through walls
        (EventKind.DISLODGED, "o0", "crate"),
    ]
    assert world.observation().object_status == (ObjectStatus.LOOSE,)


@pytest.mark.parametrize(("outside", "stays"), [(-0.02, True), (0.02, True), (0.04, False)])
def test_an_object_stays_delivered_up_to_3_cm_beside_its_receptacle(make, outside, stays):
    world = delivered(make)
    tier, crate = world._tier, world.scene.receptacles["crate"]
    address = int(world.scene.index.qpos[0])
    offset = tier.person.center(0) - world.data.qpos[address : address + 3]
    for side in (*np.eye(3), *-np.eye(3)):
        center = crate.center + crate.rotation @ (side * (crate.half_size + outside))
        world.data.qpos[address : address + 3] = center - offset
        mujoco.mj_forward(world.scene.model, world.data)
        assert tier._in_place(0) is stays


@tiers
def test_a_path_that_is_followed_while_busy_waits_for_one_step(make, fidelity):
    walking, idle = (make((1.5, 2.0, 0.0), ("cube", 2.2, 2.0), fidelity=fidelity) for _ in range(2))
    for world in (walking, idle):
        world.step(Pick())
    path = np.array([walking.observation().position, (2.5, 3.0)])
    for _ in range(3):
        step = walking.step(FollowPath(path, path[-1], 0.1, shown=True, tolerance=2.0))
        assert len(step.steps) == 1 and walking.busy
        idle.step(IDLE)
        assert walking.state_hash() == idle.state_hash()


@tiers
def test_a_copy_of_the_data_stays_while_the_world_advances(make, fidelity):
    world = make((1.5, 2.0, 0.0), ("cube", 2.2, 2.0), fidelity=fidelity)
    copied = world.copy_data()
    assert copied is not world.data
    before = world.data.qpos.copy()
    for _ in range(5):
        world.step(Move(1.0))
    assert np.array_equal(copied.qpos, before) and not np.array_equal(world.data.qpos, before)
    assert world.copy_data(copied) is copied
    assert np.array_equal(copied.qpos, world.data.qpos) and copied.time == world.data.time


def test_mujoco_keeps_no_time_in_a_world_but_by_a_clock_that_somebody_has_set(make):
    step, clock = mujoco.mjtTimer.mjTIMER_STEP, iter(range(10**9))
    world = make((1.5, 2.0, 0.0))
    run(world, [IDLE])
    assert world.data.timer[step].number and not world.data.timer[step].duration
    mujoco.set_mjcb_time(lambda: float(next(clock)))
    try:
        world = make((1.5, 2.0, 0.0))
        run(world, [IDLE])
        assert world.data.timer[step].duration > 0.0
    finally:
        mujoco.set_mjcb_time(None)


def test_a_state_that_is_not_finite_is_an_error(make):
    world = make((1.5, 2.0, 0.0), ("cube", 2.1, 2.0))
    world.data.qvel[world.scene.index.dofs[0]] = np.nan
    with pytest.raises(PhysicsError, match=r"at t = .* reset the world"):
        world.step(IDLE)
    world.reset()
    assert np.isfinite(world.step(IDLE).observation.object_positions).all()


def test_unusable_arguments_are_named(make, small_catalogue):
    world = make((1.5, 2.0, 0.0))
    with pytest.raises(ActionError, match="'jump'"):
        world.step("jump")
    with pytest.raises(PhysicsError, match=r"0\.03 s is not a whole multiple"):
        World(world.scene, WorldOptions(control_timestep=0.03))
    with pytest.raises(ActionError, match="no fidelity 'windows'; choose one of full, event"):
        WorldOptions(fidelity="windows")
    with pytest.raises(ActionError, match=r"WorldOptions\.settle_time must be a positive number, got 0"):
        WorldOptions(settle_time=0)
    bare = compose(world.scene.episode, small_catalogue, avatar=False)
    with pytest.raises(AssetError, match="avatar=True"):
        World(bare)


MOVES = st.builds(Move, *(st.floats(-b, b) for b in (2.0, 1.0, 3.0, 1.0)))
ACTIONS = st.one_of(MOVES, MOVES, MOVES, st.just(Pick()), st.just(Place()))


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(ACTIONS, st.integers(1, 25)), min_size=4, max_size=12))
def test_whatever_is_done_the_books_agree_with_the_physics(small_catalogue, script):
    placed = ("cube", 1.6, 1.8), ("ball", 1.0, 2.4), ("wedge", 1.2, 3.2)
    world = World(scene_of(small_catalogue, (1.0, 2.8, 1.5), *placed))
    for action, repeats in script:
        for _ in range(repeats):
            o = world.step(action).observation
            action = action if isinstance(action, Move) else IDLE
            assert set(o.carried) == set(o.names_with(ObjectStatus.CARRIED))
            assert 0.1 < o.position[0] < 5.9 and 0.1 < o.position[1] < 3.9
            assert o.object_positions[:, 2].min() > -0.05
    if not world.busy:
        run(world, [IDLE] * 5)
        for hand, name in enumerate(world.observation().hands):
            if name is not None:
                grip = world.data.site(f"{name}/grip_0").xpos
                hand_point = world.data.site(f"avatar/{avatar.HANDS[hand]}_grip").xpos
                assert np.linalg.norm(grip - hand_point) < 0.01


@tiers
def test_a_person_with_a_capacity_of_one_uses_the_right_hand(small_catalogue, fidelity):
    scene = scene_of(small_catalogue, (1.0, 1.0, 0.0), ("cube", 1.6, 1.3), ("ball", 1.6, 0.7))
    world = world_of(scene, fidelity, capacity=1)
    do(world, Pick("o0"))  # it is to the left of the person
    assert world.observation().hands == (None, "o0")
    assert world.answer(Pick("o1")).refusal is Refusal.HANDS_FULL
