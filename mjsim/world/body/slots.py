"""Choose slots in receptacles from height maps of their contents, which are measured by ray casts."""

import itertools
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.sites import ReceptacleGeometry
from mjsim.support.kernels import kernel
from mjsim.world.body.person import Person

Vector = NDArray[np.float64]

_WALL_GAP = 0.012  # gap between an object and the walls of its receptacle, in metres
_SIDE_GAP = 0.006  # free space required on each side of an object that is lowered, in metres
_MAX_SPACING = 0.02  # maximum distance between points of the height map, in metres
_RAYS_ABOVE = 0.2  # start height of rays above the receptacle's volume, in metres
_SLOTS = np.array(list(itertools.product((-0.5, 0.5), repeat=2)))
_OTHER_PLACES = np.array(list(itertools.product(np.linspace(-1.0, 1.0, 9), repeat=2)))
_SLOPE_COST = 2.0  # cost of the mean gap below an object, relative to the cost of an equal fill height
# Minimum reduction of the cost for which a position between the slots is chosen, in metres.
_MIN_GAIN = 0.015


@dataclass(frozen=True, eq=False)
class LoadExtent:
    """The bounding box of a held object relative to the hand, along the receptacle's axes."""

    low: Vector  # minimum coordinates of the object's corners in metres, shape (3,)
    high: Vector  # maximum coordinates of the object's corners in metres, shape (3,)


@dataclass(frozen=True, eq=False)
class Slot:
    """A position in a receptacle at which an object can be placed."""

    hand: Vector  # position of the opening hand along the receptacle's axes, in metres, shape (2,)
    fill: float  # height of the contents below the object, relative to the volume's centre, in metres
    top: float  # height of the highest contents, relative to the volume's centre, in metres


def object_corners(model: mujoco.MjModel, geoms: NDArray[np.intp]) -> Vector:
    """Return points (k, 3) in an object's body frame whose bounding box encloses its colliding geoms.

    These are the vertices of mesh geoms, and the corners of the bounding boxes of other geoms.
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


def load_extent(
    person: Person, hand: int, item: int, receptacle: ReceptacleGeometry, corners: Vector
) -> LoadExtent:
    """Return the extent of a held object, given its `corners` (k, 3) in the object's frame."""
    body = int(person.scene.index.bodies[item])
    world = corners @ person.data.xmat[body].reshape(3, 3).T + person.data.xpos[body]
    local = (world - person.data.site_xpos[person.rig.grip_sites[hand]]) @ receptacle.rotation
    return LoadExtent(low=local.min(axis=0), high=local.max(axis=0))


def best_slot(person: Person, item: int, receptacle: ReceptacleGeometry, extent: LoadExtent) -> Slot:
    """Choose the slot in which an object will lie lowest and most level.

    A receptacle has 2 x 2 slots. Among equally good slots, the nearest to the person is chosen. A position
    between slots must be better by more than `_MIN_GAIN`. If possible, the object does not touch the walls.
    """
    half = receptacle.half_size[:2]
    middle = 0.5 * (extent.low + extent.high)[:2]
    half_extent = 0.5 * (extent.high - extent.low)[:2]
    room = np.maximum(half - half_extent - _WALL_GAP, 0.0)
    points, heights = _height_map(person, item, receptacle)
    slots, others = np.clip(half * _SLOTS, -room, room), room * _OTHER_PLACES
    places = np.concatenate((slots, others))
    fills, costs = _fill_below(places, half_extent, points, heights)
    me = (np.array([*person.rig.position, 0.0]) - receptacle.center) @ receptacle.rotation
    far = np.hypot(*(slots - me[:2]).T)
    count = len(slots)
    best = int(np.lexsort((far, costs[:count].round(3)))[0])
    other = count + int(costs[count:].round(3).argmin())
    if costs[other] < costs[best] - _MIN_GAIN:
        best = other
    return Slot(hand=places[best] - middle, fill=float(fills[best]), top=float(heights.max()))


def _height_map(person: Person, item: int, receptacle: ReceptacleGeometry) -> tuple[Vector, Vector]:
    half = receptacle.half_size
    axes = [np.linspace(-h, h, 1 + 2 * int(np.ceil(h / _MAX_SPACING))) for h in half[:2]]
    local = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    points = receptacle.center[:2] + local @ receptacle.rotation[:2, :2].T
    held = [load for load in person.held if load is not None]
    ignore = np.asarray(person.scene.index.bodies[[*held, item]], np.int32)
    top = float(receptacle.center[2] + half[2]) + _RAYS_ABOVE
    heights = person.receptacle_heights.heights(person.data, receptacle, points, top, ignore)
    return local, np.asarray(np.maximum(heights - receptacle.center[2], -half[2]))


@kernel
def _fill_below(centres: Vector, half: Vector, points: Vector, heights: Vector) -> tuple[Vector, Vector]:
    fills, costs = np.full(len(centres), -np.inf), np.empty(len(centres))
    # The reach is large enough to include at least one point of the height map.
    reach = np.maximum(half + _SIDE_GAP, _MAX_SPACING)
    for k in range(len(centres)):
        total, count = 0.0, 0
        for p in range(len(points)):
            dx, dy = abs(points[p, 0] - centres[k, 0]), abs(points[p, 1] - centres[k, 1])
            if dx <= reach[0] and dy <= reach[1]:
                fills[k] = max(fills[k], heights[p])
                total += heights[p]
                count += 1
        costs[k] = fills[k] + _SLOPE_COST * (fills[k] - total / count)
    return fills, costs
