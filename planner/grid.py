"""Grids on the floor, and an index of the line segments that cross each grid cell."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import kernel

MARGIN = 1e-3  # maximum distance from a cell to the segments listed for it, in metres


class GridFrame(NamedTuple):
    """The position, resolution and size of a grid.

    The cell in row r and column c covers x_min + [c, c + 1] * resolution and y_min + [r, r + 1] * resolution.
    """

    x_min: float  # smallest coordinates of the grid in metres
    y_min: float
    resolution: float  # side length of a cell in metres
    rows: int  # number of cells along y
    columns: int  # number of cells along x

    @classmethod
    def covering(cls, bounds: tuple[float, float, float, float], resolution: float) -> "GridFrame":
        """Return a grid that covers the bounds (x_min, y_min, x_max, y_max), in metres."""
        x_min, y_min, x_max, y_max = bounds
        columns, rows = (
            max(1, math.ceil(side / resolution - 1e-9)) for side in (x_max - x_min, y_max - y_min)
        )
        return cls(float(x_min), float(y_min), float(resolution), rows, columns)

    def centres(self) -> NDArray[np.float64]:
        """Return the centres of the cells in metres, shape (rows, columns, 2)."""
        x = self.x_min + (np.arange(self.columns) + 0.5) * self.resolution
        y = self.y_min + (np.arange(self.rows) + 0.5) * self.resolution
        return np.stack(np.meshgrid(x, y), axis=-1)


class SegmentGrid(NamedTuple):
    """An index of line segments by the grid cells that they cross."""

    frame: GridFrame
    segments: NDArray[np.float64]  # x and y of both ends in metres, shape (s, 4)
    starts: NDArray[np.int64]  # index in `listed` of each cell's first entry, shape (rows * columns + 1,)
    listed: NDArray[np.int64]  # indices of the segments in each cell, grouped by cell

    @classmethod
    def build(cls, frame: GridFrame, segments: NDArray[np.float64]) -> "SegmentGrid":
        cells, numbers = crossed_cells(frame, segments)
        starts = np.zeros(frame.rows * frame.columns + 1, np.int64)
        np.cumsum(np.bincount(cells, minlength=len(starts) - 1), out=starts[1:])
        return cls(frame, segments, starts, numbers[np.argsort(cells, kind="stable")])


@kernel
def row_span(ay: float, by: float, frame: GridFrame) -> tuple[int, int]:
    first = math.floor((min(ay, by) - MARGIN - frame.y_min) / frame.resolution)
    last = math.floor((max(ay, by) + MARGIN - frame.y_min) / frame.resolution)
    return min(max(int(first), 0), frame.rows - 1), min(max(int(last), 0), frame.rows - 1)


@kernel
def column_span(ax: float, ay: float, bx: float, by: float, row: int, frame: GridFrame) -> tuple[int, int]:
    low = frame.y_min + row * frame.resolution - MARGIN
    high = low + frame.resolution + 2.0 * MARGIN
    start, end = 0.0, 1.0
    if ay != by:
        s, t = (low - ay) / (by - ay), (high - ay) / (by - ay)
        start, end = min(max(min(s, t), 0.0), 1.0), min(max(max(s, t), 0.0), 1.0)
    x, z = ax + start * (bx - ax), ax + end * (bx - ax)
    first = math.floor((min(x, z) - MARGIN - frame.x_min) / frame.resolution)
    last = math.floor((max(x, z) + MARGIN - frame.x_min) / frame.resolution)
    return min(max(int(first), 0), frame.columns - 1), min(max(int(last), 0), frame.columns - 1)


@kernel
def crossed_cells(
    frame: GridFrame, segments: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the grid cells that each line segment crosses, as two index arrays of cells and segments.

    Segments within `MARGIN` of a cell are included. Cells are numbered row by row. `segments` contains x and
    y of both ends in metres, shape (s, 4).
    """
    cells, numbers = [0], [0]
    for k in range(len(segments)):
        ax, ay, bx, by = segments[k, 0], segments[k, 1], segments[k, 2], segments[k, 3]
        first, last = row_span(ay, by, frame)
        for row in range(first, last + 1):
            left, right = column_span(ax, ay, bx, by, row, frame)
            for column in range(left, right + 1):
                cells.append(row * frame.columns + column)
                numbers.append(k)
    return np.array(cells[1:]), np.array(numbers[1:])


@kernel
def is_visible(ax: float, ay: float, bx: float, by: float, walls: SegmentGrid) -> bool:
    """Return True if the line from a to b does not touch a wall. Both points must be on the grid."""
    frame = walls.frame
    first, last = row_span(ay, by, frame)
    for row in range(first, last + 1):
        left, right = column_span(ax, ay, bx, by, row, frame)
        start, end = walls.starts[row * frame.columns + left], walls.starts[row * frame.columns + right + 1]
        for k in range(start, end):
            if touch(ax, ay, bx, by, walls.segments[walls.listed[k]]):
                return False
    return True


@kernel
def touch(ax: float, ay: float, bx: float, by: float, wall: NDArray[np.float64]) -> bool:
    """Return True if the line segment from a to b touches a wall, end points included."""
    cx, cy, dx, dy = wall[0], wall[1], wall[2], wall[3]
    if max(cx, dx) < min(ax, bx) or min(cx, dx) > max(ax, bx):
        return False
    if max(cy, dy) < min(ay, by) or min(cy, dy) > max(ay, by):
        return False
    side_c = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    side_d = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
    if (side_c > 0.0 and side_d > 0.0) or (side_c < 0.0 and side_d < 0.0):
        return False
    side_a = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
    side_b = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
    return not ((side_a > 0.0 and side_b > 0.0) or (side_a < 0.0 and side_b < 0.0))
