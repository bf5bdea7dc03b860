"""A MuJoCo model of the person, with joints for walking, turning and looking, and with two hands.

Two geoms collide if the contype of one shares a bit with the conaffinity of the other:

    geoms                     contype   conaffinity   collides with
    static (MuJoCo default)   1         1             objects, trunk
    objects (set here)        4         1 | 4         static, objects, foot
    avatar trunk              0         1             static
    avatar foot               0         4             objects
    hands                     0         0             nothing

The `ref` of each joint is the start position of its body, so joint coordinates are positions: `qpos` of
`avatar/x` is the person's x in the house, and `qpos` of `avatar/left/z` is the height of the left hand.
"""

import itertools
import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from mjsim.house.scene.arms import draw_hand
from mjsim.values.errors import AssetError
from mjsim.values.person_parameters import PersonParameters

STATIC_BIT = 1
OBJECT_BIT = 4
PREFIX = "avatar/"
BASE = "avatar/base"  # body that moves along the x and y axes
SOLE = "avatar/sole"  # body of the foot, which is fixed to the base and collides with objects
BODY = "avatar/body"  # body that rotates on the base and carries the head and the hands
HEAD = "avatar/head"
EYE = "avatar/eye"
TRUNK = "avatar/trunk"
FOOT = "avatar/foot"
HANDS = ("left", "right")
LEFT, RIGHT = 0, 1  # indices into `HANDS`
GRIPS = (0, 1)
GENTLE, FIRM = "gentle", "firm"  # types of weld constraints between a hand and an object
SIDES = 64  # number of sides of the prisms that represent the trunk and the foot
# Contact parameters of the foot: time constant in seconds, damping ratio and impedance. The low impedance
# limits the contact force, so that a person can step over an object that is stuck against a wall. Because of
# the high damping, such an object neither pushes the person away nor flies off.
_FOOT_CONTACT = (0.1, 3.0, 0.2)
EYE_FORWARD = 0.06
START_PITCH = math.radians(-12.0)
PITCH_RANGE = (math.radians(-75.0), math.radians(60.0))
# Hand positions in each posture: forward, sideways and up, in metres, for a person of default eye height.
REST = (0.34, 0.27, 1.00)
CARRY = (0.50, 0.24, 1.25)
TUCKED = (0.27, 0.19, 1.22)
ASIDE = (0.10, 0.42, 1.26)
HAND_KP, HAND_KV = 2000.0, 130.0
HAND_FORCE = 80.0
# Parameters of each weld type: time constant in seconds, torque scale, minimum and maximum impedance. A
# gentle weld turns a fallen object upright while it is lifted, without pushing nearby objects away. A firm
# weld yields by less than 2 mm and 2 degrees, even if the object hits a door frame at walking speed.
WELDS = {GENTLE: (0.08, 1.0, 0.95, 0.99), FIRM: (0.008, 2.0, 0.98, 0.998)}
_TORQUESCALE = 10  # index of the torque scale in the data of a weld constraint


def grip_name(hand: str, instance: str, grip: int, kind: str = FIRM) -> str:
    """Return the name of the `GENTLE` or `FIRM` weld between a hand and grip site 0 or 1 of an object."""
    return f"{PREFIX}{hand}/{kind}/{instance}/{grip}"


def posture(hand: int, place: tuple[float, float, float], eye_height: float) -> tuple[float, float, float]:
    """Return the position (x, y, z) of the left (0) or right (1) hand in a posture, relative to the body.

    `place` is a posture such as `CARRY`. Heights scale with the eye height. Lengths are in metres.
    """
    forward, side, up = place
    return forward, side if hand == 0 else -side, up * (eye_height / PersonParameters.eye_height)


def eye_position(
    x: float, y: float, heading: float, pitch: float, eye_height: float
) -> tuple[float, float, float]:
    """Return the position of the eyes of a person at (x, y). Lengths are in metres and angles in radians."""
    out = EYE_FORWARD * math.cos(pitch)
    height = eye_height + EYE_FORWARD * math.sin(pitch)
    return x + out * math.cos(heading), y + out * math.sin(heading), height


def attach_avatar(
    spec: mujoco.MjSpec,
    object_names: Sequence[str],
    *,
    start: tuple[float, float, float],
    person: PersonParameters,
) -> None:
    """Add the person's body, at `start` (x, y, heading), and inactive welds for the hands to a scene.

    Raises:
        AssetError: The scene has no body `<instance>/object`, or an object has no grip sites.
    """
    _set_object_bits(spec, object_names)
    body = _add_body(spec, start, person.body_radius)
    _add_head(spec, body, person)
    for number, hand in enumerate(HANDS):
        scale = person.eye_height / PersonParameters.eye_height
        _add_hand(spec, body, hand, posture(number, REST, person.eye_height), scale)
    _declare_welds(spec, object_names)


def _angle(spec: mujoco.MjSpec, radians: float) -> float:
    return math.degrees(radians) if spec.compiler.degree else radians


def _set_object_bits(spec: mujoco.MjSpec, object_names: Sequence[str]) -> None:
    for name in object_names:
        body = spec.body(f"{name}/object")
        if body is None:
            raise AssetError(
                f"the scene has no body '{name}/object'; attach the object model with prefix '{name}/'"
            )
        for geom in body.find_all(mujoco.mjtObj.mjOBJ_GEOM):
            if geom.contype or geom.conaffinity:
                geom.contype = OBJECT_BIT
                geom.conaffinity = STATIC_BIT | OBJECT_BIT


def _set_inertia(
    body: Any, mass: float, inertia: Sequence[float], centre: Sequence[float] = (0, 0, 0)
) -> None:
    body.explicitinertial = True
    body.mass = mass
    body.inertia = list(inertia)
    body.ipos = list(centre)


def _add_body(spec: mujoco.MjSpec, start: tuple[float, float, float], radius: float) -> Any:
    x, y, heading = start
    # The base cannot rotate, because contacts would make it spin.
    base = spec.worldbody.add_body(name=BASE, pos=[x, y, 0.0])
    _set_inertia(base, 60.0, (8.0, 8.0, 1.5), (0.0, 0.0, 0.9))
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    base.add_joint(name=PREFIX + "x", type=slide, axis=[1, 0, 0], ref=x)
    base.add_joint(name=PREFIX + "y", type=slide, axis=[0, 1, 0], ref=y)
    body = base.add_body(name=BODY, quat=[math.cos(heading / 2), 0.0, 0.0, math.sin(heading / 2)])
    _set_inertia(body, 10.0, (2.0, 2.0, 1.5), (0.0, 0.0, 0.9))
    body.add_joint(name=PREFIX + "yaw", type=hinge, axis=[0, 0, 1], ref=_angle(spec, heading))
    for name, kv, force in (("x", 7000.0, 600.0), ("y", 7000.0, 600.0), ("yaw", 300.0, 150.0)):
        _add_actuator(spec, name, kp=0.0, kv=kv, force=force)
    base.add_geom(
        name=TRUNK,
        pos=[0, 0, 0.88],
        conaffinity=STATIC_BIT,
        condim=1,  # contacts without friction, so that the person slides along walls
        priority=2,
        solref=[0.008, 1],
        solimp=[0.98, 0.995, 0.001, 0.5, 2],
        **_prism(spec, TRUNK, radius, 0.84),
    )
    # The foot is soft and lower than any carried object, so it pushes light objects along the floor gently.
    # It reaches below the floor, so that it touches flat objects with its side and never stands on them. It
    # has a separate body because the broad phase filters by body, and the foot never collides with the house.
    sole = base.add_body(name=SOLE)
    sole.fuse = 0
    _set_inertia(sole, 0.0, (0.0, 0.0, 0.0))
    sole.add_geom(
        name=FOOT,
        pos=[0, 0, 0.18],
        conaffinity=OBJECT_BIT,
        condim=3,
        priority=1,
        solref=list(_FOOT_CONTACT[:2]),
        solimp=[_FOOT_CONTACT[2], _FOOT_CONTACT[2], 0.001, 0.5, 2.0],
        friction=[0.3, 0.005, 0.0001],
        **_prism(spec, FOOT, radius, 0.48),
    )
    return body


def _prism(spec: mujoco.MjSpec, name: str, radius: float, half_height: float) -> dict[str, Any]:
    """Add the mesh of a prism that approximates an upright cylinder, and return the arguments of its geom.

    MuJoCo 3.17 (`multiccd`) computes wrong contact normals if the curved side of a cylinder touches the edge
    of a box. Meshes do not have this problem.
    """
    angles = np.arange(SIDES) * (2.0 * math.pi / SIDES)
    ring = radius * np.column_stack((np.cos(angles), np.sin(angles)))
    vertices = [(*point, z) for point in ring.tolist() for z in (-half_height, half_height)]
    spec.add_mesh(name=name, uservert=np.ravel(vertices))
    return {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": name, "group": 4, "contype": 0, "mass": 0.0}


def _add_actuator(spec: mujoco.MjSpec, joint: str, *, kp: float, kv: float, force: float) -> None:
    """Add a velocity servo if `kp` is 0, or a damped position servo otherwise.

    The activation is the target of the servo, and the control input is the target's rate of change. The
    target thus changes linearly during a control step.
    """
    spec.add_actuator(
        name=PREFIX + joint,
        target=PREFIX + joint,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        dyntype=mujoco.mjtDyn.mjDYN_INTEGRATOR,
        actearly=True,  # let the control input take effect in the first physics step
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        gainprm=[kp or kv] + [0.0] * 9,
        biasprm=[0.0, -kp, -kv] + [0.0] * 7,
        forcelimited=1,
        forcerange=[-force, force],
    )


def _add_head(spec: mujoco.MjSpec, body: Any, person: PersonParameters) -> None:
    # The hinge axis is -y because a positive pitch means looking up.
    half = -START_PITCH / 2
    head = body.add_body(
        name=HEAD, pos=[0, 0, person.eye_height], quat=[math.cos(half), 0, math.sin(half), 0]
    )
    head.gravcomp = 1.0
    _set_inertia(head, 4.0, (0.03, 0.03, 0.03))
    head.add_joint(
        name=PREFIX + "pitch",
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=[0, -1, 0],
        ref=_angle(spec, START_PITCH),
    )
    _add_actuator(spec, "pitch", kp=60.0, kv=3.0, force=30.0)
    # A MuJoCo camera looks along its -z axis. Its x axis points right and its y axis points up.
    fovy = round(math.degrees(person.vertical_field), 9)
    head.add_camera(name=EYE, pos=[EYE_FORWARD, 0, 0], quat=[0.5, 0.5, -0.5, -0.5], fovy=fovy)


def _add_hand(
    spec: mujoco.MjSpec, body: Any, hand: str, position: tuple[float, float, float], scale: float
) -> None:
    node = body.add_body(name=f"{PREFIX}{hand}_hand", pos=list(position))
    node.gravcomp = 1.0
    _set_inertia(node, 1.0, (0.002, 0.002, 0.002))
    for axis, start in zip("xyz", position, strict=True):
        node.add_joint(
            name=f"{PREFIX}{hand}/{axis}",
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=[float(axis == a) for a in "xyz"],
            ref=start,
        )
        _add_actuator(spec, f"{hand}/{axis}", kp=HAND_KP, kv=HAND_KV, force=HAND_FORCE)
    node.add_site(name=f"{PREFIX}{hand}_grip", pos=[0, 0, 0], size=[0.005, 0.005, 0.005], group=4)
    draw_hand(node, f"{PREFIX}{hand}", position, scale)


def _declare_welds(spec: mujoco.MjSpec, object_names: Sequence[str]) -> None:
    for name, grip in itertools.product(object_names, GRIPS):
        site = f"{name}/grip_{grip}"
        if spec.site(site) is None:
            raise AssetError(f"object '{name}' has no site '{site}'; see docs/models.md, 'An object'")
        for hand, (kind, (time, torque, low, high)) in itertools.product(HANDS, WELDS.items()):
            weld = spec.add_equality(
                name=grip_name(hand, name, grip, kind),
                type=mujoco.mjtEq.mjEQ_WELD,
                objtype=mujoco.mjtObj.mjOBJ_SITE,
                name1=f"{PREFIX}{hand}_grip",
                name2=site,
                active=False,
                solref=[time, 1.0],
                solimp=[low, high, 0.001, 0.5, 2.0],
            )
            weld.data[_TORQUESCALE] = torque
