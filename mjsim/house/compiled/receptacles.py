"""Receptacle geometry: the volume in which an object counts as delivered, and where a person stands to use it."""

from collections.abc import Iterable
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjsim.values.errors import AssetError


@dataclass(frozen=True, eq=False)
class ReceptacleGeometry:
    """One receptacle in the house frame."""

    key: str  # receptacle key
    center: NDArray[np.float64]  # centre of the delivery volume, m, (3,)
    half_size: NDArray[np.float64]  # half extents of the volume along its own axes, m, (3,)
    rotation: NDArray[np.float64]  # the volume's axes as columns, (3, 3)
    approach: NDArray[np.float64]  # floor point (x, y) where a person stands to use it, m, (2,)

    def contains(self, point: ArrayLike, margin: float = 0.005) -> bool:
        """Whether a point (3,), m, lies in the volume grown by `margin` metres."""
        local = self.rotation.T @ (np.asarray(point, dtype=np.float64) - self.center)
        return bool(np.all(np.abs(local) <= self.half_size + margin))

    def distance(self, xy: NDArray[np.float64]) -> float:
        """Horizontal distance from a floor point (2,) to the nearest point of the volume, m."""
        local = self.rotation.T @ np.array([*(xy - self.center[:2]), 0.0])
        outside = np.maximum(np.abs(local) - self.half_size, 0.0)
        return float(np.hypot(outside[0], outside[1]))


def receptacle_geometries(model: mujoco.MjModel, keys: Iterable[str]) -> dict[str, ReceptacleGeometry]:
    """Read the sites `<key>/volume`, a box, and `<key>/approach` of a compiled model; receptacles do not move."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    found = {}
    for key in keys:
        volume, approach = _site(model, key, "volume"), _site(model, key, "approach")
        if model.site_type[volume] != mujoco.mjtGeom.mjGEOM_BOX:
            raise AssetError(f"site 'volume' of receptacle {key!r} must be of type box")
        found[key] = ReceptacleGeometry(
            key=key,
            center=data.site_xpos[volume].copy(),
            half_size=model.site_size[volume].copy(),
            rotation=data.site_xmat[volume].reshape(3, 3).copy(),
            approach=data.site_xpos[approach, :2].copy(),
        )
    return found


def _site(model: mujoco.MjModel, key: str, name: str) -> int:
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, f"{key}/{name}")
    if site < 0:
        raise AssetError(f"receptacle {key!r} has no site {name!r}; add it to its model")
    return int(site)
