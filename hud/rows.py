"""Sizes of the parts of the HUD, px of a 640 x 480 frame, and which rows of a list to show."""

from collections.abc import Sequence
from dataclasses import dataclass

from hud.state import HudState

MARGIN = 8
GAP = 6
CHIP_HEIGHT = 28
CHIP_WIDTH = 76
LIST_SHARE = 0.3  # of the frame's width
LIST_WIDTH_LIMIT = 230
BINS_WIDTH = 148
BINS_WIDTH_WIDE = 164  # on frames that are wider than 4 : 3
LIST_BOTTOM = 64  # kept free below the lists, so that what lies at the feet is seen
ROW = 32
HEADER = 24
FOOTER = 17
PADDING = 6
TILE = 24
TARGET = 20
CONTEXT = 2  # rows above the current one that stay in sight
NUMBER = 19
LINE = 14
SLOT_WIDTH = 118
SLOT_WIDTH_LONG = 133  # for names that would be cut
EMPTY_WIDTH = 86  # an empty hand takes less, so that what lies at the feet is seen between the hands
BETWEEN_HANDS = 64
SLOT_HEIGHT = 40
MESSAGE_LINES = 3
MESSAGE_ICON = 26
POINTER = 36
MAP_INSET = 4
MAP_HEIGHT = 150  # at most; a narrower map leaves the bins more room
SMALLEST = (320, 240)


@dataclass(frozen=True)
class ListRow:
    """A row of the task list: its height, px, the px that its text may take, and its wrapped detail."""

    height: int
    text_width: int
    detail: tuple[str, ...]


@dataclass(frozen=True)
class BinRow:
    """A row of the list of bins: its height, px, and its wrapped place."""

    height: int
    place: tuple[str, ...]


def window(heights: Sequence[int], current: int, room: int) -> tuple[int, int]:
    """Which rows of a list to show: the current one, up to two before it, and as many after it as fit.

    Args:
        heights: Height of each row, px.
        current: Index of the current row; it is shown even when it is higher than `room`.
        room: Height that there is, px.

    Returns:
        First row, and one past the last; neither neighbour would still fit.
    """
    first, stop, used = current, current + 1, heights[current]
    while first > max(0, current - CONTEXT) and used + heights[first - 1] <= room // 2:
        first -= 1
        used += heights[first]
    while stop < len(heights) and used + heights[stop] <= room:
        used += heights[stop]
        stop += 1
    while first > 0 and used + heights[first - 1] <= room:
        first -= 1
        used += heights[first]
    return first, stop


def focus(state: HudState) -> int:
    """Index of the row that must be visible: the current one, or the first, or the last when all are done."""
    for i, row in enumerate(state.checklist):
        if row.current:
            return i
    return len(state.checklist) - 1 if state.checklist and state.checklist[-1].number is not None else 0
