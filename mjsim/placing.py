"""Placing as a motion: over a slot of the receptacle, down to the measured fill, release, wait for rest."""

import itertools
import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.escapes import REST_STEPS
from mjsim.person import Motion, Person, Steps, minimum_jerk, wrap
from mjsim.receptacles import ReceptacleGeometry

Vector = NDArray[np.float64]

_WALL_GAP = 0.012
HOVER_GAP = 0.03
RELEASE_GAP = 0.002
STILL_TIME = 0.08  # s over the slot before the way down
_PROBE_ABOVE = 0.2
_PROBES = np.linspace(-1.0, 1.0, 5)
_GRID = np.stack(np.meshgrid(_PROBES, _PROBES, indexing="ij"), axis=-1).reshape(-1, 2)
_SLOTS = np.array(list(itertools.product((-0.5, 0.5), repeat=2)))
HAND_SPEED = 0.9
DESCENT_SPEED = 0.5
_TOUCH = 0.0005
_OVERLAP = 0.001
_RAISE = 0.003


@dataclass(frozen=True, eq=False)
class Footprint:
    """Extent of a held object about the hand, in the receptacle's axes: lowest and highest corner, m, (3,)."""

    low: Vector
    high: Vector


@dataclass(frozen=True, eq=False)
class Slot:
    """Where the hand lets go: horizontal position (2,) in the receptacle's axes, and the fill height there, m."""

    hand: Vector
    fill: float


def place(person: Person, hand: int, item: int, receptacle: ReceptacleGeometry, pitch: float) -> Motion:
    """Put the object that `hand` holds into its receptacle and wait until it rests; look to `pitch`, rad, then.

    Returns:
        Whether the object's centre rests inside the receptacle's volume.
    """
    yield from person.face(receptacle.center, heading=square_heading(person, receptacle), tolerance=0.04)
    person.moving_hand = hand
    corners = object_corners(person.scene.model, person.scene.index.geoms(person.scene.index.names[item]))
    footprint = _footprint(person, hand, item, receptacle, corners)
    slots = fill_slots(person, item, receptacle, footprint)
    slot = slots[0]
    clear = max(float(receptacle.half_size[2]), *(s.fill for s in slots)) + HOVER_GAP
    yield from _travel(person, hand, receptacle, np.array([*slot.hand, clear - footprint.low[2]]))
    footprint = _footprint(person, hand, item, receptacle, corners)
    yield from _descend(person, hand, item, receptacle, slot, footprint)
    person.grips.open(hand, wake=False)  # it was set down
    success = yield from _settle(person, hand, item, receptacle, pitch)
    return success


def object_corners(model: mujoco.MjModel, geoms: NDArray[np.intp]) -> Vector:
    """Points (k, 3) of an object's body frame, m, whose bounding box encloses its colliding geoms.

    Mesh geoms give their vertices, others the corners of their bounding boxes.
    """
    points = []
    for geom in geoms:
        if not (model.geom_contype[geom] or model.geom_conaffinity[geom]):
            continue
        rotation = np.zeros(9)
        mujoco.mju_quat2Mat(rotation, model.geom_quat[geom])
        points.append(_geom_points(model, int(geom)) @ rotation.reshape(3, 3).T + model.geom_pos[geom])
    return np.concatenate(points)


def _geom_points(model: mujoco.MjModel, geom: int) -> Vector:
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom])
        first = int(model.mesh_vertadr[mesh])
        return np.array(model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])], np.float64)
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
    box = model.geom_aabb[geom]
    return np.asarray(box[:3] + signs * box[3:])


def square_heading(person: Person, receptacle: ReceptacleGeometry) -> float:
    """Heading along a side of the receptacle that is nearest to looking at it: held things fit in squarely."""
    rig = person.rig
    towards = rig.heading + rig.bearing(receptacle.center)
    side = math.atan2(receptacle.rotation[1, 0], receptacle.rotation[0, 0])
    quarter = math.pi / 2
    return rig.heading + wrap(side + quarter * round(wrap(towards - side) / quarter) - rig.heading)


def _footprint(
    person: Person, hand: int, item: int, receptacle: ReceptacleGeometry, corners: Vector
) -> Footprint:
    body = int(person.scene.index.bodies[item])
    world = corners @ person.data.xmat[body].reshape(3, 3).T + person.data.xpos[body]
    local = (world - person.data.site_xpos[person.rig.grip_sites[hand]]) @ receptacle.rotation
    return Footprint(low=local.min(axis=0), high=local.max(axis=0))


def fill_slots(person: Person, item: int, receptacle: ReceptacleGeometry, footprint: Footprint) -> list[Slot]:
    """The 2 x 2 slots, least filled and most level first, then nearest to the person.

    Fill heights and positions are relative to the centre of the receptacle's volume. Each slot is moved so
    that the object clears the walls where it can.
    """
    half = receptacle.half_size[:2]
    middle = 0.5 * (footprint.low + footprint.high)[:2]
    extent = 0.5 * (footprint.high - footprint.low)[:2]
    room = np.maximum(half - extent - _WALL_GAP, 0.0)
    me = (np.array([*person.rig.position, 0.0]) - receptacle.center) @ receptacle.rotation
    centres = [np.clip(half * side, -room, room) for side in _SLOTS]
    ranked = []
    surfaces = _surfaces(person, item, receptacle, np.array(centres), np.minimum(extent, half))
    for at, heights in zip(centres, surfaces, strict=True):
        fill = float(heights.max())
        # On a slope things tip over: what is missing below counts as if it were filled.
        cost = fill + (fill - float(heights.mean()))
        ranked.append((round(cost, 3), float(np.hypot(*(at - me[:2]))), Slot(hand=at - middle, fill=fill)))
    ranked.sort(key=lambda entry: entry[:2])
    return [slot for _, _, slot in ranked]


def _surfaces(
    person: Person, item: int, receptacle: ReceptacleGeometry, centres: Vector, extent: Vector
) -> Vector:
    """Heights of what lies below a footprint at each of several centres (k, 2), m above the volume's, (k, 25)."""
    ignore = np.array([*person.carried_bodies(), person.scene.index.bodies[item]], np.int32)
    local = (centres[:, None] + extent * _GRID).reshape(-1, 2)
    points = receptacle.center[:2] + local @ receptacle.rotation[:2, :2].T
    top = float(receptacle.center[2] + receptacle.half_size[2]) + _PROBE_ABOVE
    heights = person.soundings.heights(person.data, receptacle, points, top, ignore)
    lowest = -receptacle.half_size[2]
    return np.asarray(np.maximum(heights - receptacle.center[2], lowest).reshape(len(centres), -1))


def _hand_in_body(person: Person, receptacle: ReceptacleGeometry, local: Vector) -> Vector:
    return person.rig.to_body(receptacle.center + receptacle.rotation @ local)


def _travel(person: Person, hand: int, receptacle: ReceptacleGeometry, hover: Vector) -> Steps:
    """Up to the hover height, then across to the hover position (3,) in the receptacle's axes."""
    rig = person.rig
    for up_first in (True, False):
        start = rig.hand_targets[hand].copy()
        goal = _hand_in_body(person, receptacle, hover)
        if up_first:
            goal = np.array([start[0], start[1], max(start[2], goal[2])])
        distance = float(np.linalg.norm(goal - start))
        count = 0 if distance < 0.005 else person.steps(0.12 + distance / HAND_SPEED)
        for k in range(1, count + 1):
            if not up_first:
                goal = _hand_in_body(person, receptacle, hover)
            rig.hand_targets[hand] = start + minimum_jerk(k / count) * (goal - start)
            person.glance(receptacle.center)
            yield
    for _ in range(person.steps(STILL_TIME)):
        yield


def _descend(
    person: Person,
    hand: int,
    item: int,
    receptacle: ReceptacleGeometry,
    slot: Slot,
    footprint: Footprint,
) -> Steps:
    """Down to just above the fill; on touching anything, stop and raise until the overlap is small."""
    rig = person.rig
    start = rig.hand_targets[hand].copy()
    goal = _hand_in_body(
        person, receptacle, np.array([*slot.hand, slot.fill + RELEASE_GAP - footprint.low[2]])
    )
    count = person.steps(0.12 + abs(goal[2] - start[2]) / DESCENT_SPEED)
    for k in range(1, count + 1):
        rig.hand_targets[hand] = start + minimum_jerk(k / count) * (goal - start)
        yield
        if overlap(person, item) > _TOUCH:
            rig.hand_targets[hand] = rig.hands[hand]
            break
    for _ in range(person.steps(0.6)):
        yield
        if overlap(person, item) < _OVERLAP:
            break
        rig.hand_targets[hand, 2] += _RAISE


def overlap(person: Person, item: int) -> float:
    """Deepest overlap of object `item` with anything but the person, m."""
    data, owner = person.data, person.scene.index.geom_owner
    if not data.ncon:
        return 0.0
    geoms = data.contact.geom
    mine = (owner[geoms] == item).any(axis=1) & (geoms != person.rig.foot).all(axis=1)
    return float(max(0.0, -data.contact.dist[mine].min())) if mine.any() else 0.0


def _settle(person: Person, hand: int, item: int, receptacle: ReceptacleGeometry, pitch: float) -> Motion:
    """Withdraw the hand upwards and wait until the object rests."""
    rig, options = person.rig, person.options
    still, lifted = 0, 0
    for _ in range(person.steps(options.settle_time)):
        if lifted < 4:
            rig.hand_targets[hand, 2] += 0.035
            lifted += 1
        else:
            person.retire(hand)
        person.look_towards(pitch)
        yield
        quiet = person.speed(item) < options.settle_speed or person.asleep(item)
        still = still + 1 if quiet else 0
        if still >= REST_STEPS:
            return receptacle.contains(person.center(item), options.volume_margin)
    return False
