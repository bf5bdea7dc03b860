"""The state of a world without physics: held objects, sleeping objects, hashes, packed states and planned motions."""

import math
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_worlds import scene_of, world_of

from mjsim.house.scene import avatar
from mjsim.values.actions import EventKind
from mjsim.values.errors import StateError
from mjsim.values.options import WorldOptions
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.body.grips import AWAKE
from mjsim.world.body.rig import HEADING, X, Y
from mjsim.world.body.slots import object_corners
from mjsim.world.fidelity.event import ActiveMotion
from mjsim.world.fidelity.kinematic_steps import (
    BODY,
    GRASPS,
    HANDS,
    STATE_SIZE,
    KinematicState,
    carry,
    held_in,
    state_hash,
)
from mjsim.world.fidelity.kinematics import Gait
from mjsim.world.fidelity.motion_primitives import MotionTrajectory

PLACED = (("cube", 1.6, 2.4), ("wedge", 1.3, 1.5), ("ball", 2.2, 3.0))
coordinates = st.floats(-2.0, 2.0)


@pytest.fixture(scope="module")
def scene(small_catalogue):
    return scene_of(small_catalogue, (1.0, 2.0, 0.3), *PLACED)


@pytest.fixture
def kinematic(scene):
    return world_of(scene, "event")._tier._kinematic


def composed(first, second):
    """Return the pose (7,) that results from two poses one after the other, as MuJoCo computes it."""
    position, quaternion = np.zeros(3), np.zeros(4)
    mujoco.mju_mulPose(position, quaternion, first[:3], first[3:], second[:3], second[3:])
    return np.concatenate([position, quaternion])


@given(
    place=st.tuples(coordinates, coordinates), heading=st.floats(-7.0, 7.0),
    hands=st.lists(coordinates, min_size=6, max_size=6), grip=st.lists(coordinates, min_size=7, max_size=7),
    hand=st.integers(0, 1), item=st.integers(0, 2), which=st.integers(0, 1),
)  # fmt: skip
def test_a_held_object_is_where_body_hand_and_grip_put_it(
    scene, place, heading, hands, grip, hand, item, which
):
    """Grips of imported objects are beside their middle, and turned."""
    grip = np.array(grip)
    grip[3:] = grip[3:] / np.linalg.norm(grip[3:]) if np.linalg.norm(grip[3:]) > 0.1 else (1.0, 0.0, 0.0, 0.0)
    model = world_of(scene, "event")._tier._kinematic.model
    grips = np.zeros((3, 2, 7))
    grips[item, which] = grip
    state = KinematicState(np.zeros(STATE_SIZE), np.full((3, 7), 9.0))
    state.vector[[BODY + X, BODY + Y, BODY + HEADING]] = *place, heading
    state.vector[HANDS : HANDS + 6], state.vector[GRASPS:] = hands, -1.0
    state.vector[GRASPS + hand] = 2 * item + which
    carry(state, model._replace(grips=grips))
    body = np.array([*place, 0.0, math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)])
    held = np.array([*hands[3 * hand : 3 * hand + 3], 1.0, 0.0, 0.0, 0.0])
    assert state.poses[item] == pytest.approx(composed(composed(body, held), grip), abs=1e-12)
    assert (np.delete(state.poses, item, axis=0) == 9.0).all()
    assert [held_in(state.vector, side) for side in (hand, 1 - hand)] == [item, -1]


@pytest.mark.parametrize("grip", avatar.GRIPS)
@pytest.mark.parametrize("item", range(3))
def test_a_load_reaches_as_far_from_the_hand_as_its_corners(scene, item, grip):
    """Its corners are those of the object in the pose of the grip, which decides where it fits into a bin."""
    planner = world_of(scene, "event")._tier._planner
    corners = object_corners(scene.model, scene.index.geoms(scene.index.names[item]))
    pose = planner._kinematic.model.grips[item, grip]
    expected = [composed(pose, np.array([*corner, 1.0, 0.0, 0.0, 0.0]))[:3] for corner in corners]
    found = planner._corners_about_hand(item, grip)
    assert found == pytest.approx(np.array(expected), abs=1e-12)
    assert (np.ptp(found, axis=0) > 0.05).all()


def test_a_hash_depends_on_every_number_and_on_its_place():
    rng = np.random.default_rng(0)
    state = KinematicState(rng.normal(size=STATE_SIZE), rng.normal(size=(3, 7)))
    found = {int(state_hash(state))}
    for values in (state.vector, state.poses.reshape(-1)):
        for k in range(len(values)):
            before, values[k] = values[k], np.nextafter(values[k], 9.0)
            found.add(int(state_hash(state)))
            values[k] = before
            for other in range(k):
                values[[k, other]] = values[[other, k]]
                found.add(int(state_hash(state)))
                values[[k, other]] = values[[other, k]]
    pairs = sum(n * (n - 1) // 2 for n in (STATE_SIZE, 21))
    assert len(found) == 1 + STATE_SIZE + 21 + pairs
    assert int(state_hash(state)) in found


def test_an_object_wakes_with_those_that_came_to_rest_together_with_it(kinematic):
    trees = kinematic._index.trees
    kinematic.asleep[:] = AWAKE
    kinematic.asleep[trees[0]], kinematic.asleep[trees[1]] = trees[1], trees[0]
    kinematic.asleep[trees[2]] = trees[2]
    kinematic.wake(1)
    assert [kinematic.asleep[tree] == AWAKE for tree in trees] == [True, True, False]
    kinematic.wake(2)
    assert (kinematic.asleep[trees] == AWAKE).all()
    kinematic.wake(2)  # again
    assert (kinematic.asleep[trees] == AWAKE).all()


@pytest.mark.parametrize(("height", "at_rest"), [(-0.0005, True), (0.2, False)])
def test_at_the_start_what_lies_on_the_floor_sleeps_and_what_falls_and_the_person_do_not(
    small_catalogue, height, at_rest
):
    start = world_of(scene_of(small_catalogue, (1.0, 2.0, 0.3), *PLACED, height=height), "event")
    kinematic = start._tier._kinematic
    trees = kinematic._index.trees
    assert (kinematic.asleep[trees] == (trees if at_rest else AWAKE)).all()
    assert kinematic.asleep[kinematic.person_tree] == AWAKE


def test_a_state_is_packed_and_unpacked_whole_and_nothing_else_fits(scene, kinematic):
    other = world_of(scene, "event")._tier._kinematic
    rng = np.random.default_rng(1)
    kinematic.state.vector[:], kinematic.state.poses[:] = rng.normal(size=STATE_SIZE), rng.normal(size=(3, 7))
    kinematic.asleep[:] = AWAKE
    ring = kinematic._index.trees[:2]
    kinematic.asleep[ring] = ring[::-1]
    packed = kinematic.pack()
    other.unpack(packed)
    assert other.state_hash() == kinematic.state_hash()
    assert (other.asleep == kinematic.asleep).all()
    for damaged in (
        packed[:-1],
        np.append(packed, 0.0),
        np.where(np.arange(len(packed)) == 3, np.nan, packed),
    ):
        with pytest.raises(StateError, match=f"{len(packed)} finite ones do"):
            other.unpack(damaged)
    for wrong in (ring[1], len(kinematic.asleep)):  # two point to one, and one points to none
        broken = packed.copy()
        broken[-len(kinematic.asleep) + ring[1]] = wrong
        with pytest.raises(StateError, match="do not form rings"):
            other.unpack(broken)
    assert other.state_hash() == kinematic.state_hash(), "a state that was refused changes nothing"
    assert (other.asleep == kinematic.asleep).all()


def test_hands_grasp_and_release_objects_by_either_grip(kinematic):
    assert kinematic.grasps == [None, None]
    kinematic.asleep[:] = np.arange(len(kinematic.asleep))
    kinematic.grasp(1, 2, 1)
    kinematic.grasp(0, 0, 0)
    assert kinematic.grasps == [(0, 0), (2, 1)]
    assert [kinematic.asleep[tree] == AWAKE for tree in kinematic._index.trees] == [True, False, True]
    kinematic.release(1)
    assert kinematic.grasps == [(0, 0), None]


def test_a_gait_has_the_values_of_the_person_and_the_model(small_catalogue):
    person = PersonParameters(
        walking_speed=1.1, turning_speed=2.1, looking_speed=1.3, walking_acceleration=3.1,
        turning_acceleration=7.0, body_radius=0.21, eye_height=1.51,
    )  # fmt: skip
    scene = scene_of(small_catalogue, (1.0, 2.0, 0.3), *PLACED, person=person)
    gait, model = Gait.of(scene, WorldOptions()), scene.model
    assert gait.max_speed == person.fastest_walk
    assert (gait.max_turn, gait.max_look, gait.acceleration, gait.turn_acceleration) == (2.1, 1.3, 3.1, 7.0)
    assert gait.dt == pytest.approx(gait.substeps * model.opt.timestep) and gait.substeps > 1
    assert (gait.lowest, gait.highest) == avatar.PITCH_RANGE
    assert (gait.radius, gait.eye_height, gait.eye_forward) == (0.21, 1.51, avatar.EYE_FORWARD)
    base = int(model.jnt_bodyid[model.joint(avatar.PREFIX + "x").id])
    assert gait.mass == pytest.approx(float(model.body_subtreemass[base]))
    assert gait.inertia > gait.head_inertia > 0.0


def test_a_trajectory_grows_and_keeps_its_steps():
    trajectory = MotionTrajectory.empty(4, 2)
    trajectory.vectors[:3], trajectory.poses[:3], trajectory.length[0] = 7.0, 8.0, 3
    for steps, capacity in ((1, 8), (9, 13)):
        longer = trajectory.longer(steps)
        assert longer.vectors.shape == (capacity, STATE_SIZE) and longer.poses.shape == (capacity, 2, 7)
        assert int(longer.length[0]) == 3
        assert (longer.vectors[:3] == 7.0).all() and (longer.poses[:3] == 8.0).all()


@pytest.mark.parametrize(("played", "stop"), [(0, 4), (3, 4), (4, 9), (8, 9), (9, 12), (11, 12)])
def test_a_motion_stops_after_each_step_with_an_event_and_at_its_end(played, stop):
    incidents = ((3, EventKind.DISLODGED, 0), (8, EventKind.DISLODGED, 1))
    plan = SimpleNamespace(incidents=incidents, length=12)
    assert ActiveMotion(plan, None, 0, 0, played).next_stop == stop
