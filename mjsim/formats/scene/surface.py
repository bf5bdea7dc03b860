"""Coloured triangle meshes as NumPy arrays."""

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from mjsim.values.errors import AssetError

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

WELD_DIGITS = 6  # number of decimals to which corners must agree to be merged
_MAX_BROKEN = 0.01  # largest share of triangles that may be left out because they are not finite
_MIN_AREA = 1e-13  # minimum area of a triangle with a valid normal, in square metres


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles with a colour at each corner, which is multiplied by the texture image if there is one."""

    corners: Floats  # corners of the triangles in metres, shape (n, 3, 3)
    colours: Floats  # RGB colour at each corner, from 0 to 1, shape (n, 3, 3)
    # Texture coordinates of the corners, with the origin at the lower left of the image, shape (n, 3, 2).
    uv: Floats
    image: Ints  # index of each triangle's image, or -1 without an image, shape (n,)
    images: tuple[Floats, ...] = ()  # RGB images from 0 to 1, each (height, width, 3)

    def __len__(self) -> int:
        return len(self.corners)

    def select(self, rows: NDArray[Any]) -> Self:
        """Return the triangles that are selected by a mask (n,) or by indices (k,)."""
        arrays = {name: getattr(self, name)[rows] for name in ("corners", "colours", "uv", "image")}
        return replace(self, **arrays)

    def moved(self, transform: Floats) -> Self:
        """Apply a homogeneous transform (4, 4) to the surface."""
        return replace(self, corners=self.corners @ transform[:3, :3].T + transform[:3, 3])

    def mesh(self) -> trimesh.Trimesh:
        """Convert the surface to a mesh with shared vertices. Face k of the mesh is triangle k."""
        vertices, faces = _welded(self.corners)
        return trimesh.Trimesh(vertices, faces, process=False)

    def colours_at(self, triangles: Ints, weights: Floats) -> Floats:
        """Return the RGB colours (k, 3) of points given by triangles (k,) and barycentric weights (k, 3)."""
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
    """Remove invalid, empty and duplicate triangles. Return the new surface and the number of each kind.

    Raise an AssetError if too many triangles have corners that are not finite.
    """
    finite = np.asarray(np.isfinite(surface.corners).all(axis=(1, 2)))
    if (broken := int((~finite).sum())) > _MAX_BROKEN * len(finite):
        raise AssetError(
            f"{broken} of {len(finite)} triangles have corners that are not finite numbers; export the mesh again"
        )
    kept = surface.select(finite)
    edges = np.diff(kept.corners, axis=1)
    _, faces = _welded(kept.corners)
    distinct = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    solid = distinct & (np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) > 2 * _MIN_AREA)
    _, first = np.unique(np.sort(faces[solid], axis=1), axis=0, return_index=True)
    result = kept.select(solid).select(np.sort(first))
    counts = {
        "not finite": broken,
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
    pixels = (1.0 - places[:, 1]) * height - 0.5, places[:, 0] * width - 0.5
    channels = [map_coordinates(image[..., k], pixels, order=1, mode="grid-wrap") for k in range(3)]
    return np.stack(channels, axis=-1)
