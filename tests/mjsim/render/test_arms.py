"""Pictures show arms that join the hands to the body, and idle hands that hang at rest. The physics stays as it is."""

import itertools

import mujoco
import numpy as np
import pytest
from small_worlds import scene_of

from mjsim.house.scene.arms import HANGING, IDLE_RANGE, SHOULDER, arm_pose
from mjsim.house.scene.avatar import HANDS, REST, posture
from mjsim.render import CameraPose, Renderer
from mjsim.values.person_parameters import PersonParameters

SIZE = (320, 240)


@pytest.fixture
def person(small_catalogue):
    """A scene, and a function that places the hands in the frame of the body and returns the state."""
    scene = scene_of(small_catalogue, (1.2, 1.6, 0.3), ("cube", 2.5, 3.5))
    data = mujoco.MjData(scene.model)

    def place(*hands):
        for hand, place in zip(HANDS, hands, strict=True):
            for axis, value in zip("xyz", place, strict=True):
                data.joint(f"avatar/{hand}/{axis}").qpos[0] = value
        mujoco.mj_forward(scene.model, data)
        return data

    return scene, place


def seen(scene, data, points):
    """The geoms that a camera to the left of the person sees at points in the frame of the body."""
    body = data.body("avatar/body")
    turn = body.xmat.reshape(3, 3)
    middle = body.xpos + turn @ (0.3, 0.0, 1.0)
    camera = CameraPose.looking_at(middle + turn @ (0.0, 1.4, 0.3), middle, 1.2)
    with Renderer(scene.model, width=SIZE[0], height=SIZE[1], groups=(2,)) as renderer:
        ids = renderer.segmentation(data, camera)
    right, up, backward = ((body.xpos + np.array(points) @ turn.T - camera.position) @ camera.rotation).T
    focal = SIZE[1] / 2 / np.tan(camera.fovy / 2)
    columns, rows = SIZE[0] / 2 - focal * right / backward, SIZE[1] / 2 + focal * up / backward
    found = [int(ids[int(row), int(column)]) for column, row in zip(columns, rows, strict=True)]
    return [scene.model.geom(geom).name if geom >= 0 else "" for geom in found]


@pytest.mark.parametrize("hand", [(0.5, 0.24, 1.25), (0.9, 0.2, 0.3), (0.27, 0.19, 1.22)])
def test_a_sleeve_reaches_from_a_hand_in_use_to_the_shoulder(person, hand):
    scene, place = person
    data = place(hand, (0.34, -0.27, 1.0))
    wrist = arm_pose(hand, posture(0, REST, PersonParameters.eye_height), 1.0).wrist
    along = [(1 - share) * wrist + share * np.array(SHOULDER) for share in (0.15, 0.5, 0.85, 1.0)]
    assert seen(scene, data, along) == ["avatar/left_sleeve"] * 4


def test_an_idle_hand_hangs_beside_the_body_and_the_state_stays(person):
    scene, place = person
    data = place(REST, (REST[0], -REST[1], REST[2]))
    before = data.qpos.copy(), data.xpos.copy(), data.geom_xpos.copy()
    names = seen(scene, data, [HANGING, REST])
    assert names[0].startswith("avatar/left_") and names[0] != "avatar/left_sleeve"
    assert not names[1].startswith("avatar/left_")
    for array, kept in zip((data.qpos, data.xpos, data.geom_xpos), before, strict=True):
        assert np.array_equal(array, kept)


@pytest.mark.parametrize("scale", [0.8, 1.0, 1.2])
@pytest.mark.parametrize("side", [1, -1])
def test_a_drawn_hand_moves_without_jumps_from_rest_to_use(scale, side):
    rest = np.array(REST) * (1, side, scale)
    ways = [arm_pose(rest + np.array([gap, 0, 0]), rest, scale) for gap in np.linspace(0.0, IDLE_RANGE, 50)]
    np.testing.assert_allclose(ways[0].hand, np.array(HANGING) * (1, side, scale))
    np.testing.assert_allclose(ways[-1].hand, rest + np.array([IDLE_RANGE, 0, 0]))
    assert ways[-1].tilt == 0
    assert max(np.linalg.norm(b.hand - a.hand) for a, b in itertools.pairwise(ways)) < 0.03


def test_a_model_without_a_person_is_drawn(house_model):
    data = mujoco.MjData(house_model)
    mujoco.mj_forward(house_model, data)
    camera = CameraPose.looking_at((2.0, 8.0, 1.6), (3.0, 8.0, 1.2), 1.2)
    with Renderer(house_model, width=64, height=48) as renderer:
        assert renderer.rgb(data, camera).std() > 0
