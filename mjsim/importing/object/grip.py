"""Where a hand takes an object from above: on a rim, a bar or a flat top that is there."""

from dataclasses import dataclass

import numpy as np
import trimesh

from mjsim.formats.scene.surface import Floats

MAX_OFFSET = 0.15  # m; a load that hangs farther to one side of the hand is not carried
_RIM = 0.01  # m below the highest point; what is lower may be the bottom of something hollow
_POINTS = 100_000  # of the surface among which the grip is looked for
_FINGERS = 0.02  # m around the nearest point, within which a hand takes the crest
_CREST = 0.001  # m below the crest
_ABOVE = 0.005  # m; the centre of mass is below the surface where a point of it is this near


@dataclass(frozen=True, eq=False)
class Grip:
    """Where a hand takes an object."""

    point: Floats  # m, (3,)
    yaw: float  # direction of the fingers, across the rim towards the centre of mass, rad
    offset: float  # horizontal distance from the centre of mass, m


def find_grip(mesh: trimesh.Trimesh, centre: Floats) -> Grip:
    """The place at the top of an object's surface, m, that is nearest to the vertical through `centre` (3,), m."""
    sampled, _ = trimesh.sample.sample_surface(mesh, _POINTS, seed=0)
    points = _upper(np.concatenate((mesh.vertices, sampled)), _RIM)
    if (near := _level(points, centre) < _ABOVE).any():
        return Grip(np.array([*centre[:2], points[near, 2].max()]), 0.0, 0.0)
    crest = _nearest(_upper(points[_level(points, _nearest(points, centre)) < _FINGERS], _CREST), centre)
    forward, left = centre[:2] - crest[:2]
    return Grip(crest, float(np.arctan2(left, forward)), float(np.hypot(forward, left)))


def _upper(points: Floats, depth: float) -> Floats:
    """Those of points (n, 3) that are at most `depth` below the highest one, m."""
    return np.asarray(points[points[:, 2] > points[:, 2].max() - depth])


def _level(points: Floats, centre: Floats) -> Floats:
    """Horizontal distances (n,) of points (n, 3) from a point (3,), m."""
    return np.asarray(np.linalg.norm(points[:, :2] - centre[:2], axis=1))


def _nearest(points: Floats, centre: Floats) -> Floats:
    """The one of points (n, 3) that is horizontally nearest to a point (3,), m."""
    return np.asarray(points[_level(points, centre).argmin()])
