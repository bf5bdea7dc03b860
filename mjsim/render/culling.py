"""ViewVolume culling: leaving out geoms behind the eye or beside the view, which most of a house is.

The rasteriser submits every geom of the scene, and on a CPU transforming their vertices costs more than the
pixels do. Leaving those out does not change a frame as long as nothing casts shadows or is mirrored into it.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.render.cameras import ViewVolume

# Metres; far above rounding in single precision, far below what would cost time.
_MARGIN = 0.01
# The rasteriser draws nothing for it.
_NOTHING = int(mujoco.mjtGeom.mjGEOM_NONE)
# Comparing with the enumeration itself takes ten times as long.
_GEOM = int(mujoco.mjtObj.mjOBJ_GEOM)


class Bounds(NamedTuple):
    """What the geoms of a model fill, each in its own frame."""

    radii: NDArray[np.float64]  # of spheres around their origins, m, (ngeom,); 0 means unbounded
    boxes: NDArray[np.float64]  # centres and half-sizes of boxes, m, (ngeom, 6)

    @classmethod
    def of(cls, model: Any) -> "Bounds":
        """Those of a model. The engine takes all planes for infinite, but draws those with a size as rectangles."""
        radii, boxes = model.geom_rbound.copy(), model.geom_aabb.copy()
        plane = model.geom_type == mujoco.mjtGeom.mjGEOM_PLANE
        finite = plane & (model.geom_size[:, :2] > 0.0).all(axis=1)
        half = model.geom_size[finite, :2]
        radii[finite] = np.hypot(*half.T)
        boxes[finite] = np.pad(half, ((0, 0), (3, 1)))
        return cls(radii, boxes)


def outside(
    view: ViewVolume, aspect: float, centres: NDArray[np.float64], radii: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Which spheres (n,) are wholly outside a view; a radius of 0 means unbounded. Some near corners are kept."""
    right, up, backward = ((centres - view.position) @ view.rotation).T
    ahead, reach = -backward, radii + _MARGIN
    vertical, horizontal = view.half_height, view.half_height * aspect
    apart = (ahead + reach < view.near) | (ahead - reach > view.far)
    for offset, half in ((right, horizontal), (up, vertical)):
        if view.orthographic:
            apart |= np.abs(offset) - half > reach
        else:
            # Signed distance to the nearer side plane of the pyramid, times the length of its normal.
            apart |= np.abs(offset) - half * ahead > reach * np.hypot(1.0, half)
    return np.asarray(apart & (radii > 0.0))


@contextmanager
def without(scene: Any, hidden: NDArray[np.bool_]) -> Iterator[None]:
    """Draw a scene without the model geoms whose ids `hidden` (ngeom,) marks."""
    geoms = scene.geoms[: scene.ngeom]
    # Geoms of other origin index the extra entry at the end.
    owners = [geom.objid if geom.objtype == _GEOM else -1 for geom in geoms]
    chosen = [geoms[index] for index in np.flatnonzero(np.append(hidden, False)[owners])] if owners else []
    types = [geom.type for geom in chosen]
    try:
        for geom in chosen:
            geom.type = _NOTHING
        yield
    finally:
        for geom, kept in zip(chosen, types, strict=True):
            geom.type = kept
