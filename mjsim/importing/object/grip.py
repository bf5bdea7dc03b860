"""Grasp of an object from above at a rim, a bar or a flat top."""

from dataclasses import dataclass

import numpy as np
import trimesh

from mjsim.formats.scene.surface import Floats

MAX_OFFSET = 0.15  # maximum horizontal distance from a carried object's centre of mass to the hand, in metres
_RIM = 0.01  # depth below the highest point in metres; lower points may be at the bottom of a hollow object
_POINTS = 100_000  # number of surface points from which the grip is chosen
_FINGERS = 0.02  # radius around the nearest point in which the hand may grasp the crest, in metres
_CREST = 0.001  # points count as part of the crest up to this depth below it, in metres
_ABOVE = 0.005  # points within this horizontal distance count as above the centre of mass, in metres


@dataclass(frozen=True, eq=False)
class Grip:
    """A grasp of an object."""

    point: Floats  # grasped point in metres, shape (3,)
    yaw: float  # direction of the fingers in radians, across the rim towards the centre of mass
    offset: float  # horizontal distance from the centre of mass, in metres


def find_grip(mesh: trimesh.Trimesh, centre: Floats) -> Grip:
    """Find the point at the top of an object's surface, in metres, that is nearest to a vertical through `centre`."""
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
