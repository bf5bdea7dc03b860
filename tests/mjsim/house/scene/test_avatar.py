"""The person's body: where it stands, what it touches, what its hands can hold."""

import itertools
import math

import mujoco
import numpy as np
import pytest
from small_worlds import scene_of, world_of

from mjsim.house.scene import avatar
from mjsim.values.actions import Move
from mjsim.values.errors import AssetError
from mjsim.values.person_parameters import PersonParameters

START = (1.2, 0.9, 0.7)


@pytest.fixture(scope="module")
def small_scene(small_catalogue):
    return scene_of(small_catalogue, START, ("cube", 2.0, 3.0), ("ball", 4.0, 1.0))


@pytest.fixture
def data(small_scene):
    data = mujoco.MjData(small_scene.model)
    mujoco.mj_forward(small_scene.model, data)
    return data


def joint_address(model, name):
    return int(model.joint(avatar.PREFIX + name).qposadr[0])


def test_joint_coordinates_are_house_coordinates(small_scene, data):
    model = small_scene.model
    for pose in (START, (4.3, 2.2, -2.0)):
        for name, value in zip(("x", "y", "yaw"), pose, strict=True):
            data.qpos[joint_address(model, name)] = value
        mujoco.mj_forward(model, data)
        body = data.body(avatar.BODY)
        assert body.xpos == pytest.approx((pose[0], pose[1], 0.0), abs=1e-12)
        assert body.xmat.reshape(3, 3)[:, 0] == pytest.approx(
            (math.cos(pose[2]), math.sin(pose[2]), 0), abs=1e-12
        )


def test_the_eye_looks_ahead_and_slightly_down(small_scene, data):
    camera = data.cam(avatar.EYE)
    looks = -camera.xmat.reshape(3, 3)[:, 2]
    down = math.radians(12)
    expected = (
        math.cos(down) * math.cos(START[2]),
        math.cos(down) * math.sin(START[2]),
        -math.sin(down),
    )
    assert looks == pytest.approx(expected, abs=1e-9)
    assert camera.xpos[2] == pytest.approx(1.6, abs=0.02)
    upright = camera.xmat.reshape(3, 3)[:, 1]
    assert upright[2] > 0.9
    data.qpos[joint_address(small_scene.model, "pitch")] = math.radians(30)
    mujoco.mj_forward(small_scene.model, data)
    assert -camera.xmat.reshape(3, 3)[2, 2] == pytest.approx(math.sin(math.radians(30)))


def _pairs(model, data):
    """Kinds of geoms that touch: `static`, an object's body or the avatar's geom, sorted and joined."""

    def kind(geom):
        name = model.geom(geom).name
        body = int(model.geom_bodyid[geom])
        if name.startswith(avatar.PREFIX):
            return name
        return "static" if model.body_weldid[body] == 0 else "object"

    return {"|".join(sorted(map(kind, pair))) for pair in data.contact.geom}


def test_trunk_meets_the_house_only_and_the_foot_objects_only(small_scene, data):
    model = small_scene.model
    # Half inside a wall, with both objects inside the person, hands inside the wall and the objects.
    data.qpos[joint_address(model, "x")] = 0.1
    for name in ("o0", "o1"):
        address = model.joint(f"{name}/free").qposadr[0]
        data.qpos[address : address + 3] = (0.15, 0.9, 0.3)
    for hand in avatar.HANDS:
        for axis, value in zip("xyz", (-0.1, 0.0, 0.35), strict=True):
            data.qpos[joint_address(model, f"{hand}/{axis}")] = value
    mujoco.mj_forward(model, data)
    pairs = _pairs(model, data)
    assert {"avatar/trunk|static", "avatar/foot|object", "object|object"} <= pairs
    assert not {p for p in pairs if "avatar" in p} - {"avatar/trunk|static", "avatar/foot|object"}


def test_hands_hold_still_against_gravity(small_scene, data):
    model = small_scene.model
    before = data.qpos.copy()
    for actuator in range(model.nu):
        name = model.actuator(actuator).name
        joint = model.joint(name)
        if name.split("/")[-1] not in ("x", "y", "yaw") or name.count("/") == 2:
            data.act[model.actuator_actadr[actuator]] = before[joint.qposadr[0]]
    mujoco.mj_step(model, data, 500)
    mine = [joint_address(model, f"{hand}/{axis}") for hand in avatar.HANDS for axis in "xyz"]
    assert data.qpos[mine] == pytest.approx(before[mine], abs=1e-6)


def test_every_hand_can_hold_every_object_at_either_grip(small_scene, data):
    model = small_scene.model
    assert model.neq == 2 * 2 * 2 * 2
    assert not data.eq_active.any()
    for hand in avatar.HANDS:
        for name in ("o0", "o1"):
            for grip, kind in itertools.product(avatar.GRIPS, avatar.WELDS):
                weld = model.equality(avatar.grip_name(hand, name, grip, kind)).id
                sites = (model.eq_obj1id[weld], model.eq_obj2id[weld])
                assert [model.site(s).name for s in sites] == [f"avatar/{hand}_grip", f"{name}/grip_{grip}"]


def _without_grip(spec):
    body = spec.worldbody.add_body(name="c/object")
    body.add_freejoint()
    body.add_geom(size=[0.05, 0, 0])


def _nothing(_):
    pass


@pytest.mark.parametrize(
    ("change", "message"), [(_nothing, "no body 'c/object'"), (_without_grip, "no site 'c/grip_0'")]
)
def test_incomplete_objects_are_named(change, message):
    spec = mujoco.MjSpec()
    change(spec)
    with pytest.raises(AssetError, match=message):
        avatar.attach_avatar(spec, ["c"], start=(0, 0, 0), person=PersonParameters())


@pytest.mark.parametrize("fidelity", ["full", "event"])
def test_hands_stay_below_low_eyes(small_catalogue, fidelity):
    """Empty hands keep their proportion to the eyes, also after a walk."""
    person = PersonParameters(eye_height=1.1)
    world = world_of(scene_of(small_catalogue, START, ("cube", 2.0, 3.0), person=person), fidelity)
    for _ in range(10):
        world.step(Move(forward=0.5))
    heights = [world.data.site(f"{avatar.PREFIX}{hand}_grip").xpos[2] for hand in avatar.HANDS]
    assert heights == pytest.approx([1.1 / 1.6 * avatar.REST[2]] * 2, abs=0.03)


def test_hands_mirror_each_other():
    for place in (avatar.REST, avatar.CARRY, avatar.ASIDE, avatar.TUCKED):
        left, right = avatar.posture(0, place, 1.6), avatar.posture(1, place, 1.6)
        assert np.array(left) * (1, -1, 1) == pytest.approx(right)
        assert left[1] > 0
