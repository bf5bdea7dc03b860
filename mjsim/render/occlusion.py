"""Occlusion culling, which skips geoms that are completely hidden behind a wall or another large box.

A box hides all geoms in the shadow that it would cast if the eye were a light source. The shadow is computed
for the rectangle through the middle of the box that is parallel to its largest faces.
"""

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.render.cameras import Bounds, ViewVolume
from mjsim.support.kernels import inlined, kernel

_MIN_HALF_SIZE = 0.4  # a box may hide geoms if at least two of its half sizes exceed this length in metres
_TESTED = 40  # maximum number of boxes that are tested per view; those that look largest are chosen
_MARGIN = 0.01  # tolerance in metres, much larger than single-precision rounding errors


class BoxOccluders:
    """Large boxes of a model that may hide other geoms. `shown` is a mask (ngeom,) of the geoms to draw."""

    def __init__(self, model: Any, bounds: Bounds, shown: NDArray[np.bool_]) -> None:
        size = model.geom_size
        box = (model.geom_type == mujoco.mjtGeom.mjGEOM_BOX) & (np.sort(size, axis=1)[:, 1] > _MIN_HALF_SIZE)
        self._model = model
        self._bounds = bounds
        self._shown = shown & (bounds.radii > 0.0)
        self._ids = np.flatnonzero(box & shown & ~_see_through_texture(model))
        self._thin = np.argmin(size[self._ids], axis=1)

    def unseen(
        self,
        view: ViewVolume,
        aspect: float,
        positions: NDArray[np.float64],
        rotations: NDArray[np.float64],
        seen: NDArray[np.bool_],
    ) -> NDArray[np.bool_]:
        """Return a mask (ngeom,) of the `seen` geoms that are outside a perspective view or behind a box."""
        result = np.zeros(len(seen), dtype=bool)
        if view.orthographic:
            return result
        planes, offsets = self._shadows(view, aspect, positions[self._ids], rotations[self._ids])
        tested = np.flatnonzero(seen & self._shown)
        away = positions[tested] - view.position
        pyramid = _pyramid(view, aspect)
        boxes = self._bounds.boxes[tested]
        result[tested] = _outside_or_covered(pyramid, planes, offsets, away, rotations[tested], boxes)
        return result

    def _shadows(
        self, view: ViewVolume, aspect: float, positions: NDArray[np.float64], rotations: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the planes of each shadow as inward normals (k, 5, 3) and distances in metres (k, 5).

        The first four planes contain the eye and one edge of the rectangle. The fifth contains the rectangle.
        """
        ids, rows = self._ids, np.arange(len(self._ids))
        axes = rotations.transpose(0, 2, 1)  # the rows of each matrix are the axes of a box
        size = self._model.geom_size[ids]
        one, two = (self._thin + 1) % 3, (self._thin + 2) % 3
        centre, normal = positions - view.position, axes[rows, self._thin]
        across, along = axes[rows, one] * size[rows, one, None], axes[rows, two] * size[rows, two, None]
        ahead = np.einsum("ij,ij->i", normal, centre)
        # Closer boxes are not used, because the near plane could clip them, which makes their inside visible.
        clear = 1.5 * view.near * np.sqrt(1.0 + view.half_height**2 * (1.0 + aspect**2))
        usable = (np.abs(ahead) - size[rows, self._thin] > clear) & ~translucent_geoms(self._model)[ids]
        distance = np.maximum(np.linalg.norm(centre, axis=1), 1e-6)
        looks = size[rows, one] * size[rows, two] * np.abs(ahead) / distance**3
        chosen = np.argsort(-np.where(usable, looks, 0.0), kind="stable")[:_TESTED]
        chosen = chosen[usable[chosen]]
        sides = _side_planes(centre[chosen], across[chosen], along[chosen])
        away = normal[chosen] * np.sign(ahead[chosen])[:, None]
        planes = np.concatenate([sides, away[:, None]], axis=1)
        offsets = np.zeros(planes.shape[:2])
        offsets[:, 4] = np.abs(ahead[chosen])
        return planes, offsets


def _side_planes(
    centre: NDArray[np.float64], across: NDArray[np.float64], along: NDArray[np.float64]
) -> NDArray[np.float64]:
    one, other = centre + across, centre - across
    corners = np.stack([one + along, other + along, other - along, one - along], axis=1)
    sides = np.cross(corners, np.roll(corners, -1, axis=1))
    sides /= np.linalg.norm(sides, axis=2, keepdims=True)
    return np.asarray(sides * np.sign(np.einsum("kij,kj->ki", sides, centre))[..., None])


def _pyramid(view: ViewVolume, aspect: float) -> NDArray[np.float64]:
    right, up, backward = view.rotation.T
    horizontal, vertical = -view.half_height * aspect * backward, -view.half_height * backward
    sides = np.stack([horizontal - right, horizontal + right, vertical - up, vertical + up])
    return np.asarray(sides / np.linalg.norm(sides, axis=1, keepdims=True))


@kernel
def _outside_or_covered(
    pyramid: NDArray[np.float64],
    planes: NDArray[np.float64],
    offsets: NDArray[np.float64],
    away: NDArray[np.float64],
    rotations: NDArray[np.float64],
    boxes: NDArray[np.float64],
) -> NDArray[np.bool_]:
    result = np.zeros(len(away), np.bool_)
    for c in range(len(away)):
        for side in range(len(pyramid)):
            middle, reach = _extent(pyramid[side], away[c], rotations[c], boxes[c])
            result[c] |= middle + reach < -_MARGIN
        for k in range(len(planes)):
            if result[c]:
                break
            covered = True
            for side in range(5):
                middle, reach = _extent(planes[k, side], away[c], rotations[c], boxes[c])
                if middle - reach - offsets[k, side] <= _MARGIN:
                    covered = False
                    break
            result[c] = covered
    return result


@inlined
def _extent(
    normal: NDArray[np.float64],
    away: NDArray[np.float64],
    rotation: NDArray[np.float64],
    box: NDArray[np.float64],
) -> tuple[float, float]:
    middle = reach = 0.0
    for axis in range(3):
        along = normal[0] * rotation[0, axis] + normal[1] * rotation[1, axis] + normal[2] * rotation[2, axis]
        middle += normal[axis] * away[axis] + along * box[axis]
        reach += abs(along) * box[3 + axis]
    return middle, reach


def translucent_geoms(model: Any) -> NDArray[np.bool_]:
    """Return a mask (ngeom,) of the geoms that are translucent because of their own colour or their material."""
    translucent = model.geom_rgba[:, 3] < 1.0
    if model.nmat:
        translucent |= (model.geom_matid >= 0) & (model.mat_rgba[model.geom_matid, 3] < 1.0)
    return np.asarray(translucent)


def _see_through_texture(model: Any) -> NDArray[np.bool_]:
    if not model.nmat or not model.ntex:
        return np.zeros(model.ngeom, dtype=bool)
    textures = model.mat_texid.reshape(model.nmat, -1)
    alpha = ((textures >= 0) & (model.tex_nchannel[textures] == 4)).any(axis=1)
    return np.asarray((model.geom_matid >= 0) & alpha[model.geom_matid])
