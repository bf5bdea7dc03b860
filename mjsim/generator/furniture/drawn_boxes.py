"""Compute the bounding boxes of the drawn geoms of furniture from their MJCF elements."""

import xml.etree.ElementTree as ET

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Boxes = NDArray[np.float64]  # rows of x0, y0, z0, x1, y1, z1 in metres, shape (n, 6)
_HIDDEN = ("guard", "shadow")  # default classes of geoms that are not drawn as solids
# Axes of the default classes for walls, by the last letter of their names.
_AXES = {"x": "0 1 0 0 0 1", "y": "1 0 0 0 0 1"}


def drawn_boxes(geoms: str) -> Boxes:
    """Return the bounding boxes of all drawn geoms, in the frame of their body."""
    elements = ET.fromstring(f"<body>{geoms}</body>")
    boxes = [_box(element) for element in elements if element.get("class") not in _HIDDEN]
    return np.array(boxes).reshape(-1, 6)


def _box(geom: ET.Element) -> Boxes:
    shape, size = geom.get("type", "box"), _numbers(geom, "size")
    if geom.get("fromto"):
        start, end = _numbers(geom, "fromto").reshape(2, 3)
        along = (end - start) / np.linalg.norm(end - start)
        radius = size[0] * (np.sqrt(np.maximum(1 - along**2, 0.0)) if shape == "cylinder" else np.ones(3))
        return np.concatenate([np.minimum(start, end) - radius, np.maximum(start, end) + radius])
    if shape in ("sphere", "cylinder"):
        size = np.array([size[0], size[0], size[-1]])
    at, turn = _numbers(geom, "pos"), _rotation(geom)
    if turn is not None:
        size = np.sqrt(turn**2 @ size**2) if shape == "ellipsoid" else np.abs(turn) @ size
    return np.concatenate([at - size, at + size])


def _numbers(geom: ET.Element, name: str) -> NDArray[np.float64]:
    return np.array(geom.get(name, "0 0 0").split(), float)


def _rotation(geom: ET.Element) -> NDArray[np.float64] | None:
    """Return the rotation matrix of a geom, or None for the identity."""
    _, has_normal, normal = geom.get("class", "").rpartition("_")
    if axes := geom.get("xyaxes", _AXES[normal] if has_normal else ""):
        (a, b, c), (d, e, f) = np.array(axes.split(), float).reshape(2, 3).tolist()
        return np.array([[a, d, b * f - c * e], [b, e, c * d - a * f], [c, f, a * e - b * d]])
    if geom.get("euler") is None:
        return None
    return np.asarray(Rotation.from_euler("XYZ", _numbers(geom, "euler")).as_matrix())
