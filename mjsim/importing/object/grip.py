"""Find a point where a hand can grasp an object from above, such as a rim, a bar or a flat top."""

from dataclasses import dataclass

import numpy as np
import trimesh

from mjsim.formats.scene.surface import Floats

MAX_OFFSET = 0.15  # maximum horizontal distance from an object's centre of mass to the hand, in metres
_RIM = 0.01  # maximum depth of the grasped point below the top of the object, in metres
_POINTS = 100_000  # number of random surface points from which the grip is chosen
_FINGERS = 0.02  # radius around the best point within which the hand may grasp the object, in metres
_CREST = 0.001  # maximum depth of the grasped point below the highest point around it, in metres
_ABOVE = 0.005  # horizontal distance within which a point counts as above the centre of mass, in metres


@dataclass(frozen=True, eq=False)
class Grip:
    """The point and the direction in which a hand grasps an object."""

    point: Floats  # point that the hand grasps, in metres, shape (3,)
    yaw: float  # direction of the fingers in radians, across the rim towards the centre of mass
    offset: float  # horizontal distance of the point from the centre of mass, in metres


def find_grip(mesh: trimesh.Trimesh, centre: Floats) -> Grip:
    """Find the point on top of an object that is horizontally closest to its centre of mass, in metres."""
    sampled, _ = trimesh.sample.sample_surface(mesh, _POINTS, seed=0)
    points = _upper(np.concatenate((mesh.vertices, sampled)), _RIM)
    if (near := _horizontal_distances(points, centre) < _ABOVE).any():
        return Grip(np.array([*centre[:2], points[near, 2].max()]), 0.0, 0.0)
    crest = _nearest(
        _upper(points[_horizontal_distances(points, _nearest(points, centre)) < _FINGERS], _CREST), centre
    )
    forward, left = centre[:2] - crest[:2]
    return Grip(crest, float(np.arctan2(left, forward)), float(np.hypot(forward, left)))


def _upper(points: Floats, depth: float) -> Floats:
    return np.asarray(points[points[:, 2] > points[:, 2].max() - depth])


def _horizontal_distances(points: Floats, centre: Floats) -> Floats:
    return np.asarray(np.linalg.norm(points[:, :2] - centre[:2], axis=1))


def _nearest(points: Floats, centre: Floats) -> Floats:
    return np.asarray(points[_horizontal_distances(points, centre).argmin()])
