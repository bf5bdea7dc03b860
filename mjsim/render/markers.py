"""Decorative geoms, called markers, that are added to a scene for a single frame."""

import math
from collections.abc import Sequence
from typing import Any, Protocol

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.render.cameras import ViewVolume, outside
from mjsim.values.errors import RenderError

MAX_MARKERS = 1024
# A marker emits most of its colour and reflects a little light. It therefore looks similar in every room.
_EMITTED = 0.62
_LIT = 0.32
_HIDDEN_OPACITY = 0.3  # opacity of an x-ray marker that is behind other geoms
# Lines around an x-ray marker that is behind other geoms, from the inside to the outside. Every colour has a contrast
# of at least 3 : 1 to one of these two tones (WCAG 2.2, 1.4.11).
LINES: tuple[tuple[int, int, int], ...] = ((8, 15, 51), (242, 242, 242))
LINE_WIDTH = 0.0025  # width of each line as a fraction of the picture's height
_AMBIENT = 0.3  # ambient light that MuJoCo adds to a scene without lights
_DEPTH_TOLERANCE = 1e-4  # relative tolerance for rounding errors when the depths of two passes are compared
_OUTLINE = 1.4  # radius of an outline as a multiple of the sphere's radius
_OUTLINE_RGBA = (0.03, 0.06, 0.20, 1.0)
_NO_OBJECT = int(mujoco.mjtObj.mjOBJ_UNKNOWN)
_SHAPES = {
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "box": mujoco.mjtGeom.mjGEOM_BOX,
}
_SIZES = {"sphere": 1, "cylinder": 2, "box": 3}


class MarkerLike(Protocol):
    """The interface of markers. A sphere with a true attribute `outlined` is drawn with a dark outline."""

    @property
    def shape(self) -> str:
        """The shape, which is `sphere`, `cylinder` (upright) or `box`."""
        ...

    @property
    def position(self) -> Sequence[float] | NDArray[np.float64]:
        """The centre in the house frame, in metres, shape (3,)."""
        ...

    @property
    def size(self) -> Sequence[float] | NDArray[np.float64]:
        """The size in metres: a radius (1,), a radius and half the length (2,), or three half sizes (3,)."""
        ...

    @property
    def rgba(self) -> Sequence[float] | NDArray[np.float64]:
        """Red, green, blue and opacity, each from 0 to 1, shape (4,)."""
        ...

    @property
    def x_ray(self) -> bool:
        """True if the marker shows faintly through walls."""
        ...


def add_markers(scene: Any, markers: Sequence[MarkerLike], *, flat: bool = False) -> None:
    """Append markers to a scene's geoms. If `flat` is True, they are opaque and have their exact colour.

    Raises:
        RenderError: There are too many markers, or one has an unknown shape or invalid numbers.
    """
    if len(markers) > MAX_MARKERS:
        raise RenderError(f"{len(markers)} markers in a frame; at most {MAX_MARKERS} can be drawn")
    for marker in markers:
        rgba = np.array(_numbers(marker, "rgba", 4), dtype=np.float32)
        rgba[:3] *= 1.0 if flat else _LIT
        if flat:
            rgba[3] = 1.0
        size, position = geom_size(marker), np.array(_numbers(marker, "position", 3))
        geom = add_decorative_geom(scene, _SHAPES[marker.shape], size, position, rgba)
        geom.emission = 1.0 - _AMBIENT if flat else _EMITTED / _LIT


def add_decorative_geom(
    scene: Any,
    shape: mujoco.mjtGeom,
    size: NDArray[np.float64],
    position: NDArray[np.float64],
    rgba: NDArray[np.float32],
) -> Any:
    """Append an upright matt geom to a scene. It does not appear in segmentation images."""
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(geom, shape, size, position, np.eye(3).ravel(), rgba)
    # MuJoCo's initialization does not reset these fields, which may still refer to another geom.
    geom.objtype, geom.objid = _NO_OBJECT, -1
    geom.category = mujoco.mjtCatBit.mjCAT_DECOR
    geom.emission = geom.specular = geom.shininess = geom.reflectance = 0.0
    geom.segid = -1
    scene.ngeom += 1
    return geom


def blend_hidden(
    frame: NDArray[np.uint8],
    colour: NDArray[np.uint8],
    scene_depth: NDArray[np.float32],
    marker_depth: NDArray[np.float32],
) -> None:
    """Blend the image `colour` into `frame` in place, at all pixels where a marker is behind another geom.

    Images have shape (h, w, 3). Depths have shape (h, w), with 1 at the near plane and 0 for the background.
    """
    hidden = (marker_depth > 0) & (marker_depth < scene_depth * (1 - _DEPTH_TOLERANCE))
    mixed = frame[hidden] * (1 - _HIDDEN_OPACITY) + colour[hidden] * _HIDDEN_OPACITY
    frame[hidden] = np.round(mixed).astype(np.uint8)


def outline_hidden(
    frame: NDArray[np.uint8], scene_depth: NDArray[np.float32], marker_depth: NDArray[np.float32]
) -> None:
    """Draw lines in place around markers that are behind other geoms. Arguments are as for `blend_hidden`."""
    taken = marker_depth > 0
    left, top, width, height = cv2.boundingRect(taken.view(np.uint8))
    if not width:
        return
    side = max(1, round(LINE_WIDTH * frame.shape[0]))
    margin = side * len(LINES)
    area = np.s_[max(0, top - margin) : top + height + margin, max(0, left - margin) : left + width + margin]
    depth, taken = marker_depth[area], taken[area]
    for colour in LINES:
        depth = cv2.dilate(depth, np.ones((2 * side + 1, 2 * side + 1), np.uint8))
        line = (depth > 0) & (depth < scene_depth[area] * (1 - _DEPTH_TOLERANCE)) & ~taken
        frame[area][line] = colour
        taken = taken | line


def in_view(view: ViewVolume, aspect: float, markers: Sequence[MarkerLike]) -> list[MarkerLike]:
    """Return the markers inside a view, followed by their outlines. Raise a RenderError if one is invalid."""
    if len(markers) > MAX_MARKERS:
        raise RenderError(f"{len(markers)} markers in a frame; at most {MAX_MARKERS} can be drawn")
    if not markers:
        return []
    for marker in markers:  # invalid markers outside the view raise an error too
        _numbers(marker, "rgba", 4)
    centres = np.array([_numbers(marker, "position", 3) for marker in markers])
    radii = np.array([np.linalg.norm(geom_size(marker)) for marker in markers])
    beside = outside(view, aspect, centres, radii)
    shown = [marker for marker, away in zip(markers, beside, strict=True) if not away]
    return [*shown, *(_Outline(marker, view) for marker in shown if getattr(marker, "outlined", False))]


class _Outline:
    """The outline of a sphere, drawn as a larger dark sphere behind it."""

    shape, rgba, x_ray = "sphere", _OUTLINE_RGBA, False

    def __init__(self, marker: MarkerLike, view: ViewVolume) -> None:
        centre, radius = np.array(_numbers(marker, "position", 3)), _OUTLINE * float(marker.size[0])
        away = centre - view.position
        self.size = (radius,)
        self.position = centre + away * (radius / max(float(np.linalg.norm(away)), radius))


def geom_size(marker: MarkerLike) -> NDArray[np.float64]:
    """Return a marker's size as a MuJoCo geom size, in metres, shape (3,). Raise a RenderError if invalid."""
    if marker.shape not in _SHAPES:
        raise RenderError(f"marker shape {marker.shape!r} is unknown; use one of {sorted(_SHAPES)}")
    size = _numbers(marker, "size", _SIZES[marker.shape])
    if min(size) <= 0.0:
        raise RenderError(f"marker sizes must be positive, got {marker.size!r} for a {marker.shape}")
    return np.array((*size, 0.0, 0.0)[:3])


def _numbers(marker: MarkerLike, field: str, count: int) -> list[float]:
    values = [float(value) for value in getattr(marker, field)]
    if len(values) < count or not all(map(math.isfinite, values)):
        raise RenderError(f"marker {field} needs {count} finite numbers, got {getattr(marker, field)!r}")
    return values[:count]
