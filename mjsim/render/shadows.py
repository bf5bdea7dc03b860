"""Contact shadows, which are soft dark spots under objects near the floor. They replace slower shadow maps.

A spot is a flat box with a soft round texture that is added to the scene for one frame. It is slightly wider
than the object above it and fades as the object is lifted. It affects neither depth nor segmentation images.
"""

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.render.cameras import ViewVolume, outside
from mjsim.render.markers import add_decorative_geom

# Name of a material with a round texture that fades outwards. Houses without it have no contact shadows.
MATERIAL = "shadow_round"
BORDER = 0.05  # how far a shadow with its faint edges extends beyond the object, in metres
# Height of a spot above the object's lowest point, in metres. Spots must be above rugs (at most 5 mm, see
# docs/models.md) and below the bottom of a plate (7 mm).
LIFT = 0.006
_THICKNESS = 1e-4
REACH = 0.3  # height above which an object has no contact shadow, in metres


class ContactShadows:
    """Contact shadows of the free bodies in a model. `shown` is a mask (ngeom,) of the geoms to draw."""

    def __init__(self, model: Any, shown: NDArray[np.bool_]) -> None:
        free = model.jnt_bodyid[model.jnt_type == mujoco.mjtJoint.mjJNT_FREE]
        owner = model.body_rootid[model.geom_bodyid]
        geoms = np.flatnonzero(shown & np.isin(owner, free) & (model.geom_rbound > 0.0))
        self._geoms = geoms[np.argsort(owner[geoms], kind="stable")]
        bodies = owner[self._geoms]
        self._starts = np.flatnonzero(np.diff(bodies, prepend=-1)) if len(bodies) else np.zeros(0, np.intp)
        self._bounds = model.geom_aabb[self._geoms]
        self._material = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_MATERIAL, MATERIAL)
        self._rgba = model.mat_rgba[self._material].copy() if self._material >= 0 else np.zeros(4)

    @property
    def count(self) -> int:
        """The maximum number of geoms that `add` appends."""
        return len(self._starts)

    def add(
        self,
        scene: Any,
        view: ViewVolume,
        aspect: float,
        positions: NDArray[np.float64],
        rotations: NDArray[np.float64],
    ) -> None:
        """Append all visible spots to a scene, which must have space for `count` more geoms."""
        if not len(self._starts) or self._material < 0:
            return
        low, high = self._boxes(positions[self._geoms], rotations[self._geoms])
        middle, half = (low + high) / 2, (high - low) / 2
        height = np.maximum(low[:, 2], 0.0)  # the bounding box of a tilted mesh may extend into the floor
        strength = np.clip(1.0 - height / REACH, 0.0, 1.0)
        centres = np.column_stack((middle[:, :2], height + LIFT))
        radii = np.hypot(half[:, 0], half[:, 1]) + 2 * BORDER
        seen = (strength > 0.0) & ~outside(view, aspect, centres, radii)
        for index in np.flatnonzero(seen):
            self._append(scene, centres[index], half[index, :2] + BORDER, strength[index])

    def _append(
        self, scene: Any, centre: NDArray[np.float64], half: NDArray[np.float64], strength: float
    ) -> None:
        rgba = (self._rgba * [1.0, 1.0, 1.0, strength]).astype(np.float32)
        # Rugs are translucent planes, which MuJoCo draws before other translucent geoms. So the shadow is no plane.
        box = mujoco.mjtGeom.mjGEOM_BOX
        geom = add_decorative_geom(scene, box, np.array([*half, _THICKNESS]), centre, rgba)
        geom.matid, geom.texcoord = self._material, 0

    def _boxes(
        self, positions: NDArray[np.float64], rotations: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        middle = positions + np.einsum("cij,cj->ci", rotations, self._bounds[:, :3])
        reach = np.einsum("cij,cj->ci", np.abs(rotations), self._bounds[:, 3:])
        lower = np.minimum.reduceat(middle - reach, self._starts, axis=0)
        return lower, np.maximum.reduceat(middle + reach, self._starts, axis=0)
