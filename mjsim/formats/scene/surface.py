"""Arrays of a mesh's triangles and their colours."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import trimesh
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

WELD_DIGITS = 6  # corners count as equal if they agree to 1e-6 m
_MIN_AREA = 1e-13  # area in square metres below which a triangle has no normal


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles with colours. The colour of a point is interpolated from the corners and multiplied by the image."""

    corners: Floats  # corners of the triangles in metres, shape (n, 3, 3)
    colours: Floats  # colour at each corner, RGB from 0 to 1, shape (n, 3, 3)
    # Repeating texture coordinates of the corners, from 0 to 1 starting at the lower left, shape (n, 3, 2).
    uv: Floats
    image: Ints  # index of each triangle's image, or -1 for none, shape (n,)
    images: tuple[Floats, ...] = ()  # RGB from 0 to 1, rows from the top, shape (height, width, 3) each

    def __len__(self) -> int:
        return len(self.corners)

    def select(self, rows: NDArray[Any]) -> Self:
        """Return the triangles selected by a mask (n,) or by row numbers (k,)."""
        arrays = {name: getattr(self, name)[rows] for name in ("corners", "colours", "uv", "image")}
        return replace(self, **arrays)

    def moved(self, transform: Floats) -> Self:
        """Return the surface moved by a homogeneous transform (4, 4)."""
        return replace(self, corners=self.corners @ transform[:3, :3].T + transform[:3, 3])

    def mesh(self) -> trimesh.Trimesh:
        """Return a mesh whose triangles are joined where corners coincide. Face k is triangle k."""
        vertices, faces = _welded(self.corners)
        return trimesh.Trimesh(vertices, faces, process=False)

    def colours_at(self, triangles: Ints, weights: Floats) -> Floats:
        """Return colours (k, 3), RGB from 0 to 1, of points given by triangles (k,) and barycentric weights (k, 3)."""
        colours: Floats = np.einsum("kc,kcd->kd", weights, self.colours[triangles])
        places = np.einsum("kc,kcd->kd", weights, self.uv[triangles])
        for number, image in enumerate(self.images):
            mine = self.image[triangles] == number
            colours[mine] *= _sample(image, places[mine])
        return colours


def joined(surfaces: list[Surface]) -> Surface:
    first = np.cumsum([0, *(len(s.images) for s in surfaces)])
    return Surface(
        corners=np.concatenate([s.corners for s in surfaces]),
        colours=np.concatenate([s.colours for s in surfaces]),
        uv=np.concatenate([s.uv for s in surfaces]),
        image=np.concatenate(
            [np.where(s.image < 0, -1, s.image + k) for s, k in zip(surfaces, first, strict=False)]
        ),
        images=tuple(image for s in surfaces for image in s.images),
    )


def cleaned(surface: Surface) -> tuple[Surface, dict[str, int]]:
    """Remove triangles that are not finite, have no area, or are duplicates. Return also the number of each."""
    finite = np.asarray(np.isfinite(surface.corners).all(axis=(1, 2)))
    kept = surface.select(finite)
    edges = np.diff(kept.corners, axis=1)
    _, faces = _welded(kept.corners)
    distinct = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    solid = distinct & (np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) > 2 * _MIN_AREA)
    _, first = np.unique(np.sort(faces[solid], axis=1), axis=0, return_index=True)
    result = kept.select(solid).select(np.sort(first))
    counts = {
        "not finite": int((~finite).sum()),
        "without area": int((~solid).sum()),
        "duplicate": int(solid.sum()) - len(result),
    }
    return result, counts


def _welded(corners: Floats) -> tuple[Floats, Ints]:
    points = np.round(corners.reshape(-1, 3), WELD_DIGITS) + 0.0
    vertices, faces = np.unique(points, axis=0, return_inverse=True)
    return vertices, faces.reshape(-1, 3)


def _sample(image: Floats, places: Floats) -> Floats:
    height, width = image.shape[:2]
    x, y = places[:, 0] * width - 0.5, (1.0 - places[:, 1]) * height - 0.5
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    across, down = (x - left)[:, None], (y - top)[:, None]
    columns, rows = (left % width, (left + 1) % width), (top % height, (top + 1) % height)
    upper = image[rows[0], columns[0]] * (1 - across) + image[rows[0], columns[1]] * across
    lower = image[rows[1], columns[0]] * (1 - across) + image[rows[1], columns[1]] * across
    return np.asarray(upper * (1 - down) + lower * down)
