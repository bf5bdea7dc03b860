"""Map cube textures to flat images for glTF, after cutting triangles along the edges of the cube."""

import itertools

import numpy as np

from mjsim.formats.gltf.shapes import Floats, Indices, Shape

FACES = 6  # number of cube faces, which are stacked in the image in the order +x, -x, +y, -y, +z, -z
_MAX_SHIFT = 0.015  # maximum image distortion at the midpoint of an edge, as a fraction of the face width
_MAX_CUTS = 4  # maximum number of times an edge is halved
_EDGE = 1e-6  # relative tolerance for directions that lie on an edge of the cube
# Cube axis and direction in which the columns and rows of each face increase, as in OpenGL.
_COLUMNS = ((2, -1.0), (2, 1.0), (0, 1.0), (0, 1.0), (0, 1.0), (0, -1.0))
_ROWS = ((1, -1.0), (1, -1.0), (2, 1.0), (2, -1.0), (1, -1.0), (1, -1.0))


def laid_out(shape: Shape, scale: Floats, side: int, faces: int) -> Shape:
    """Add texture coordinates for a surrounding cube texture to a shape.

    Args:
        shape: The shape. The direction of a vertex from the centre of the cube is `unscaled * scale`.
        scale: Scale factors of the directions, shape (3,).
        side: Width of a cube face in pixels.
        faces: Number of faces in the image, which is 6, or 1 if all sides show the same face.
    """
    directions = shape.unscaled * scale
    corners = np.concatenate((shape.positions, shape.normals, directions), axis=1)[shape.triangles]
    for i, j in itertools.combinations(range(3), 2):
        for sign in (-1.0, 1.0):
            corners = _cut(corners, sign, 6 + i, 6 + j)
    for _ in range(_MAX_CUTS):
        corners = _halved(corners)
    face = _faces_of(corners)
    uv = _coordinates(corners[..., 6:], face)
    inset = 0.5 / side  # half a pixel, so that texture filtering does not blend adjacent faces
    uv = np.clip(uv, inset, 1.0 - inset)
    if faces > 1:
        uv[..., 1] = (uv[..., 1] + face[:, None]) / faces
    return _joined(corners, uv)


def _cut(corners: Floats, sign: float, i: int, j: int) -> Floats:
    values = corners[..., i] - sign * corners[..., j]
    values[np.abs(values) <= _EDGE * np.linalg.norm(corners[..., 6:], axis=-1)] = 0.0
    crossing = (values.min(axis=1) < 0.0) & (values.max(axis=1) > 0.0)
    pieces = [corners[~crossing]]
    corners, values = corners[crossing], values[crossing]
    # Order the corners so that the first is alone on its side of the cut, or on a cut between the others.
    signs = np.sign(values)
    alone = np.where(
        (signs == 0.0).any(axis=1),
        np.argmin(np.abs(signs), axis=1),
        np.argmax(signs == -np.sign(signs.sum(axis=1))[:, None], axis=1),
    )
    turn = (alone[:, None] + np.arange(3)) % 3
    a, b, c = np.moveaxis(np.take_along_axis(corners, turn[..., None], axis=1), 1, 0)
    at, bt, ct = np.take_along_axis(values, turn, axis=1).T
    through = at == 0.0
    middle = _between(b, c, bt, ct)
    pieces += [_triangles(a, b, middle)[through], _triangles(a, middle, c)[through]]
    a, b, c, at, bt, ct = (values[~through] for values in (a, b, c, at, bt, ct))
    left, right = _between(a, b, at, bt), _between(a, c, at, ct)
    pieces += [_triangles(a, left, right), _triangles(left, b, c), _triangles(left, c, right)]
    return np.concatenate(pieces)


def _between(a: Floats, b: Floats, at: Floats, bt: Floats) -> Floats:
    """Interpolate between `a` and `b`, whose values are `at` and `bt`. Return the points (t, k) with the value zero."""
    share = np.divide(at, at - bt, out=np.zeros_like(at), where=at != bt)[:, None]
    return a + share * (b - a)


def _halved(corners: Floats) -> Floats:
    """Divide triangles into four if linear interpolation would shift the image by more than `_MAX_SHIFT`."""
    after = np.roll(corners, -1, axis=1)
    face = _faces_of(corners)
    ends = _coordinates(corners[..., 6:], face), _coordinates(after[..., 6:], face)
    middle = _coordinates((corners + after)[..., 6:], face)
    shifted = (np.abs((ends[0] + ends[1]) / 2 - middle) > _MAX_SHIFT).any(axis=(1, 2))
    a, b, c = np.moveaxis(corners[shifted], 1, 0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
    return np.concatenate([corners[~shifted], *(_triangles(*part) for part in parts)])


def _triangles(a: Floats, b: Floats, c: Floats) -> Floats:
    return np.stack((a, b, c), axis=1)


def _faces_of(corners: Floats) -> Indices:
    middle = corners[..., 6:].mean(axis=1)
    axis = np.abs(middle).argmax(axis=1)
    is_negative = np.take_along_axis(middle, axis[:, None], axis=1)[:, 0] < 0.0
    return np.asarray(2 * axis + is_negative, np.int64)


def _coordinates(directions: Floats, face: Indices) -> Floats:
    axes = np.array([(column[0], row[0]) for column, row in zip(_COLUMNS, _ROWS, strict=True)])[face]
    signs = np.array([(column[1], row[1]) for column, row in zip(_COLUMNS, _ROWS, strict=True)])[face]
    depth = np.abs(np.take_along_axis(directions, (face // 2)[:, None, None], axis=2))
    across = np.take_along_axis(directions, np.repeat(axes[:, None], 3, axis=1), axis=2)
    return np.asarray(0.5 + 0.5 * signs[:, None] * across / np.maximum(depth, 1e-9))


def _joined(corners: Floats, uv: Floats) -> Shape:
    rows = np.concatenate((corners, uv), axis=2).reshape(-1, 11)
    _, first, index = np.unique(rows.round(9), axis=0, return_index=True, return_inverse=True)
    rows = rows[first]
    normals = rows[:, 3:6] / np.linalg.norm(rows[:, 3:6], axis=1, keepdims=True)
    return Shape(rows[:, :3], normals, index.reshape(-1, 3), rows[:, 6:9], rows[:, 9:])
