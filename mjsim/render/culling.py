"""View culling: leaving out geoms behind the eye or beside the view, which most of a house is.

The rasteriser submits every geom of the scene, and on a CPU transforming their vertices costs more than the
pixels do. Leaving those out does not change a frame as long as nothing casts shadows or is mirrored into it.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.render.cameras import View

# Metres; far above rounding in single precision, far below what would cost time.
_MARGIN = 0.01
# The rasteriser draws nothing for it.
_NOTHING = int(mujoco.mjtGeom.mjGEOM_NONE)
# Comparing with the enumeration itself takes ten times as long.
_GEOM = int(mujoco.mjtObj.mjOBJ_GEOM)


def outside(
    view: View, aspect: float, centres: NDArray[np.float64], radii: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Which spheres lie wholly outside a view.

    Args:
        view: Perspective or orthographic.
        aspect: Width over height of the image.
        centres: Shape (n, 3), m.
        radii: Shape (n,), m; 0 or less means unbounded, which is never outside.

    Returns:
        Mask, shape (n,). A sphere near a corner of the view may be kept although it is outside.
    """
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
