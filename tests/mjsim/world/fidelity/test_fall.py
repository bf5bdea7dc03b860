"""What the physics starts from when an object is released in a world without physics."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from small_worlds import scene_of, world_of

from mjsim.house.scene.avatar import LEFT, RIGHT
from mjsim.world.body.grips import AWAKE
from mjsim.world.body.rig import (
    BODY_SIZE,
    FORWARD,
    HEADING,
    SERVO,
    TURN_RATE,
    VX,
    VY,
    X,
    Y,
)
from mjsim.world.fidelity.fall import _enter
from mjsim.world.fidelity.kinematic_steps import BODY, HAND_SPEEDS, HANDS, TIME, KinematicState, carry

PLACED = (("cube", 1.6, 2.4), ("wedge", 1.3, 1.5), ("ball", 2.2, 3.0))
CUBE, WEDGE, BALL = range(3)
speeds = st.floats(-2.0, 2.0)


@pytest.fixture(scope="module")
def tier(small_catalogue):
    return world_of(scene_of(small_catalogue, (1.0, 2.0, 0.3), *PLACED), "event")._tier


def moving(tier, body, hands):
    """Put a cube and a ball into the hands of a person who moves and turns, and enter the physics."""
    tier.reset()
    kinematic = tier._kinematic
    vector = kinematic.state.vector
    vector[TIME] = 12.5
    vector[BODY + VX : BODY + BODY_SIZE] = body
    vector[[BODY + X, BODY + Y, BODY + HEADING]] = 1.2, 1.9, 2.0
    vector[HANDS : HANDS + 6] = 0.4, 0.25, 1.1, 0.5, -0.2, 0.9
    vector[HAND_SPEEDS : HAND_SPEEDS + 6] = hands
    kinematic.grasp(LEFT, CUBE, 1)
    kinematic.grasp(RIGHT, BALL, 0)
    _enter(tier._full, kinematic)
    return kinematic, tier._full


def moved(kinematic, seconds):
    """Return the poses of all objects after the person has moved on for a moment at the current speeds."""
    state = KinematicState(kinematic.state.vector.copy(), kinematic.state.poses.copy())
    body = state.vector[BODY:HANDS]
    body[[X, Y, HEADING]] += seconds * body[[VX, VY, TURN_RATE]]
    state.vector[HANDS:HAND_SPEEDS] += seconds * state.vector[HAND_SPEEDS : HAND_SPEEDS + 6]
    carry(state, kinematic.model)
    return state.poses


@pytest.mark.parametrize("grip", [0, 1])
def test_a_held_object_is_turned_as_its_grip_says_however_it_lay(tier, grip):
    tier.reset()
    kinematic = tier._kinematic
    lay = Rotation.from_euler("xyz", (0.3, -0.4, 0.5))
    kinematic.state.poses[CUBE, 3:] = lay.as_quat(scalar_first=True)
    kinematic.state.vector[BODY + HEADING] = 2.0
    kinematic.grasp(LEFT, CUBE, grip)
    held = kinematic.state.poses[CUBE, 3:]
    assert np.linalg.norm(held) == pytest.approx(1.0)
    site = Rotation.from_quat(tier._full.scene.model.site(f"o{CUBE}/grip_{grip}").quat, scalar_first=True)
    turned = Rotation.from_quat(held, scalar_first=True) * site
    assert turned.as_matrix() == pytest.approx(Rotation.from_euler("z", 2.0).as_matrix(), abs=1e-12)


@given(body=st.lists(speeds, min_size=12, max_size=12), hands=st.lists(speeds, min_size=6, max_size=6))
@settings(max_examples=20, deadline=None)
def test_held_objects_move_with_the_body_and_the_hands_when_the_physics_begins(tier, body, hands):
    kinematic, full = moving(tier, body, hands)
    h = 1e-6
    ahead, behind = moved(kinematic, h), moved(kinematic, -h)
    for item in (CUBE, BALL):
        dof = int(full.scene.index.dofs[item])
        velocity = full.data.qvel[dof : dof + 6]
        assert velocity[:3] == pytest.approx((ahead[item, :3] - behind[item, :3]) / (2 * h), abs=1e-6)
        turned = np.zeros(3)
        mujoco.mju_subQuat(turned, ahead[item, 3:], behind[item, 3:])
        assert velocity[3:] == pytest.approx(turned / (2 * h), abs=1e-6)


@given(body=st.lists(speeds, min_size=12, max_size=12), hands=st.lists(speeds, min_size=6, max_size=6))
@settings(max_examples=10, deadline=None)
def test_poses_speeds_commands_and_grips_are_those_of_the_world_without_physics(tier, body, hands):
    kinematic, full = moving(tier, body, hands)
    rig, vector = full.person.rig, kinematic.state.vector
    assert full.data.time == 12.5
    assert full.poses() == pytest.approx(kinematic.state.poses)
    assert rig.body_state == pytest.approx(vector[BODY:HANDS])
    assert rig.rates[4:] == pytest.approx(hands)
    assert rig.hand_targets.ravel() == pytest.approx(vector[HANDS:HAND_SPEEDS])
    assert full.person.hand_velocities.ravel() == pytest.approx(hands)
    state = rig.get_state()
    assert state.motion == pytest.approx(vector[BODY + FORWARD : BODY + SERVO])
    assert state.command == pytest.approx([*vector[BODY + SERVO : HANDS], *vector[HANDS:HAND_SPEEDS]])
    assert full.person.grips.gripped == (CUBE, BALL)


def test_only_the_object_that_rests_sleeps_and_it_does_not_move(tier):
    kinematic, full = moving(tier, [0.0] * 12, [0.0] * 6)
    trees, index = full.scene.index.trees, full.scene.index
    kinematic.asleep[trees[WEDGE]] = trees[WEDGE]
    kinematic.asleep[trees[[CUBE, BALL]]] = AWAKE
    _enter(full, kinematic)
    assert full.data.tree_asleep[trees[WEDGE]] >= 0
    assert (full.data.tree_asleep[trees[[CUBE, BALL]]] < 0).all()
    assert full.data.tree_asleep[kinematic.person_tree] < 0
    assert full.is_settled, "held objects do not count"
    before = full.data.qpos[index.qpos[WEDGE] :][:7].copy()
    full.person.advance()
    assert (full.data.qpos[index.qpos[WEDGE] :][:7] == before).all()
