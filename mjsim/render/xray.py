"""Hidden parts of see-through markers, found by comparing the depths of two passes."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mjsim.render.cameras import View
from mjsim.render.markers import MarkerLike, geom_size

OPACITY = 0.3
# Both passes draw a visible marker at the same depth up to rounding.
_DEPTH_TOLERANCE = 1e-4


def screen_rectangle(
    view: View, markers: Sequence[MarkerLike], size: tuple[int, int]
) -> tuple[int, int, int, int] | None:
    """Smallest pixel rectangle that holds all markers in view, or None.

    Args:
        view: Perspective view.
        markers: Bounded by their spheres.
        size: Width and height of the image, pixels.

    Returns:
        Left, bottom, width, height in pixels, rows from the bottom.
    """
    if not markers:
        return None
    width, height = size
    centres = np.array([np.asarray(m.position, dtype=np.float64) for m in markers])
    radii = np.array([np.linalg.norm(geom_size(m)) for m in markers])
    right, up, backward = ((centres - view.position) @ view.rotation).T
    ahead = -backward + radii > view.near
    if not ahead.any():
        return None
    right, up, nearest, radii = right[ahead], up[ahead], (-backward - radii)[ahead], radii[ahead]
    if (nearest < view.near).any():
        return 0, 0, width, height
    # Bounding a sphere by the square in front of it overestimates, which only costs pixels.
    scale = height / 2 / view.half_height
    columns = _span(right, radii, nearest, scale, width)
    rows = _span(up, radii, nearest, scale, height)
    if columns is None or rows is None:
        return None
    return columns[0], rows[0], columns[1] - columns[0], rows[1] - rows[0]


def _span(
    centre: NDArray[np.float64],
    radii: NDArray[np.float64],
    near: NDArray[np.float64],
    scale: float,
    side: int,
) -> tuple[int, int] | None:
    far = near + 2 * radii
    low, high = centre - radii, centre + radii
    low = np.where(low < 0, low / near, low / far) * scale + side / 2
    high = np.where(high > 0, high / near, high / far) * scale + side / 2
    first, last = max(0, int(np.floor(low.min())) - 1), min(side, int(np.ceil(high.max())) + 1)
    return (first, last) if first < last else None


def blend_hidden(
    frame: NDArray[np.uint8],
    colour: NDArray[np.uint8],
    scene_depth: NDArray[np.float32],
    marker_depth: NDArray[np.float32],
) -> None:
    """Blend `colour` into `frame` (both (h, w, 3)) in place where a marker lies behind the scene.

    Depths are reversed: 1 at the near plane, 0 where nothing was drawn, shape (h, w).
    """
    hidden = (marker_depth > 0) & (marker_depth < scene_depth * (1 - _DEPTH_TOLERANCE))
    mixed = frame[hidden] * (1 - OPACITY) + colour[hidden] * OPACITY
    frame[hidden] = np.round(mixed).astype(np.uint8)
