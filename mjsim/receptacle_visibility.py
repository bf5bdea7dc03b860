"""Which receptacles a person sees: rays from the eye to the volumes that things are put into."""

from collections.abc import Mapping

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjsim.model.receptacles import ReceptacleGeometry
from mjsim.sight_lines import OFFSETS
from mjsim.visibility import FieldOfView, first_hit, in_field_of_view

WALL = 0.06  # m: what lies nearer to a volume is the receptacle's own wall


def visible_receptacles(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    receptacles: Mapping[str, ReceptacleGeometry],
    eye: ArrayLike,
    heading: float,
    pitch: float = 0.0,
    *,
    field: FieldOfView,
    own: NDArray[np.bool_] | None = None,
) -> frozenset[str]:
    """Keys of the receptacles in view.

    A receptacle is in view when one of seven rays, to the middle of its volume and to points around it, is inside the
    field of view and meets nothing before the receptacle.

    Args:
        model: Any model that contains the house.
        data: Its state, with geom poses up to date.
        receptacles: Those to look for, by key.
        eye: Eye position, m, shape (3,).
        heading: Yaw of the gaze, rad, 0 along +x, counter-clockwise.
        pitch: Elevation of the gaze, rad, positive upwards.
        field: Field of view.
        own: Which geoms belong to the person and hide nothing, shape (ngeom,); None for none.
    """
    origin = np.array(eye, dtype=np.float64)
    person = np.zeros(model.ngeom, np.bool_) if own is None else own
    seen = set()
    for key, receptacle in receptacles.items():
        points = receptacle.center + (OFFSETS * receptacle.half_size) @ receptacle.rotation.T
        near = np.linalg.norm(points - origin, axis=1) <= field.range
        inside = near & in_field_of_view(points, origin, heading, pitch, field)
        if any(_is_open(model, data, origin, point - origin, receptacle, person) for point in points[inside]):
            seen.add(key)
    return frozenset(seen)


def _is_open(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    eye: NDArray[np.float64],
    ray: NDArray[np.float64],
    receptacle: ReceptacleGeometry,
    person: NDArray[np.bool_],
) -> bool:
    """Whether a ray (3,) from the eye to a point in the volume meets nothing before the receptacle."""
    geom, share = first_hit(model, data, eye, ray, person)
    return geom < 0 or share >= 1.0 or receptacle.contains(eye + share * ray, WALL)
