"""List the poses in which furniture can stand in a room."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from mjsim.generator.furniture.piece import Piece, Spot
from mjsim.generator.values import BACK, Rectangle, Side

STEP = 0.1  # distance between poses that are tried along a wall, in metres
WALL_GAP = 0.01  # gap between a piece of furniture and the wall behind it, in metres

Floats = NDArray[np.float64]


def wall_poses(floor: Rectangle, piece: Piece, sides: Iterable[Side]) -> Floats:
    """Return all poses of a piece along walls, in rows of x, y, quarter turns, and position along the wall."""
    half = piece.size[0] / 2
    found = [np.empty((0, 4))]
    for side in sides:
        low, high = floor.wall(side)
        first, last = low + half + WALL_GAP, high - half - WALL_GAP
        if last < first:
            continue
        turns = BACK[side]
        if piece.stands in ("left", "right"):
            at_low = (piece.stands == "left") == (turns in (0, 1))
            along = np.array([first if at_low else last])
        else:
            along = np.round(np.append(np.arange(first, last - 0.001, STEP), last), 3)
        x, y = floor.along(side, first, first, WALL_GAP, WALL_GAP).center
        rows = np.tile((x, y, turns, 0.0), (len(along), 1))
        rows[:, 0 if side in ("south", "north") else 1] = rows[:, 3] = along
        found.append(rows)
    return np.concatenate(found)


def free_poses(floor: Rectangle) -> Floats:
    """Return poses on a grid in two orientations, in the same format as `wall_poses`."""
    xs, ys = np.arange(floor.x0, floor.x1, 2 * STEP), np.arange(floor.y0, floor.y1, 2 * STEP)
    grid = np.stack(np.meshgrid(xs, ys, (0.0, 1.0), (0.0,), indexing="ij"), axis=-1)
    return grid.reshape(-1, 4)


def moved_spots(spots: Sequence[Spot], places: Floats) -> Floats:
    """Move rectangles to n poses. Return their bounding rectangles, shape (n, k, 4)."""
    x0, y0, x1, y1 = np.round(np.array(spots, float).reshape(-1, 4), 4).T
    turned = np.array([[x0, y0, x1, y1], [-y1, x0, -y0, x1], [-x1, -y1, -x0, -y0], [y0, -x1, y1, -x0]])
    return np.asarray(turned.swapaxes(1, 2)[places[:, 2].astype(int)] + places[:, None, [0, 1, 0, 1]])
