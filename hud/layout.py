"""The layout of the HUD's panels, which never overlap.

progress        message bar         clock
task list                            bins
  ...             (free view)         ...
  ...              inventory          mini-map

In a wide frame, the view is a picture between the panels. In other frames, the panels are over the picture.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hud import theme
from hud.canvas import Rect
from hud.errors import FrameError
from hud.state import BinEntry, ChecklistItem, HudState, Message, MiniMap
from hud.text import Typeface

CONTEXT_ROWS = 2  # number of rows that stay visible above the current row
MIN_ASPECT_BESIDE = 1.4  # minimum ratio of width to height for panels next to the picture, as on the page
MIN_UNIT_BESIDE = 0.5  # minimum scale at which the panels next to the picture are legible
# Margins around a picture above, below, left and right of it, in theme pixels
_BORDERS = (
    theme.MARGIN + theme.CHIP_HEIGHT + theme.GAP,
    theme.GAP + theme.SLOT_HEIGHT + theme.MARGIN,
    2 * theme.MARGIN + theme.MAX_LIST_WIDTH,
    2 * theme.MARGIN + theme.BINS_WIDTH_BESIDE,
)


@dataclass(frozen=True)
class ListRow:
    """The layout of a row in a list: its height, the width of its text, and the lines of its detail."""

    height: int
    text_width: int
    detail: tuple[str, ...]


@dataclass(frozen=True)
class Layout:
    """The rectangles of all panels in a frame, and the text that fits into the panels."""

    panels: Mapping[str, Rect]  # rectangles of the visible panels by name, in drawing order
    free: Rect  # area between the panels, which no panel covers
    first: int  # index of the first visible row of the task list
    rows: tuple[ListRow, ...]  # visible rows of the task list
    bin_rows: tuple[ListRow, ...]  # visible rows of the list of bins
    message_lines: tuple[str, ...]  # lines of the message

    @property
    def stop(self) -> int:
        """The index after the last visible row of the task list."""
        return self.first + len(self.rows)


def unit_of(width: int, height: int, *, beside: bool = False) -> float:
    """Return the scale of the panels in a frame, in frame pixels per theme pixel.

    `beside` is True if the panels are next to the picture.
    """
    smallest = theme.MIN_FRAME
    if width < smallest[0] or height < smallest[1]:
        raise FrameError(
            f"frame of {width} x {height} px is too small for the HUD; use {smallest[0]} x {smallest[1]}"
        )
    across, up = theme.BESIDE_FRAME if beside else theme.FRAME
    return min(width / across, height / up)


def margins(width: int, height: int) -> tuple[int, int, int, int]:
    """Return the margins (top, bottom, left, right) around a picture, in pixels, in which all panels fit.

    Only long messages may extend into the picture.
    """
    top, below, left, right = _BORDERS
    across, up = theme.BESIDE_FRAME
    unit = min(width / (across - left - right), height / (up - top - below))
    return round(top * unit), round(below * unit), round(left * unit), round(right * unit)


def picture_rect(width: int, height: int) -> Rect | None:
    """Return the part of a frame that shows the picture, or None if the panels overlap the picture.

    The panels are next to the picture if the frame is wide and large enough for legible text.
    """
    unit = unit_of(width, height, beside=True)
    if width < MIN_ASPECT_BESIDE * height or unit < MIN_UNIT_BESIDE:
        return None
    top, below, left, right = (round(border * unit) for border in _BORDERS)
    return Rect(left, top, width - left - right, height - top - below)


def arrange(state: HudState, width: int, height: int, typeface: Typeface, *, beside: bool = False) -> Layout:
    """Compute the layout of all panels of a HUD state except the pointer."""
    grid = _PanelGrid(width, height, typeface, beside)
    checklist, first, rows = grid.checklist(state.checklist, state.scroll)
    minimap = grid.minimap(state.minimap)
    bins, bin_rows = grid.bins(state.bins, minimap)
    message, lines = grid.message(state.message)
    inventory = grid.inventory()
    wanted = {
        "progress": grid.chip(grid.margin) if state.total > 0 else None,
        "clock": grid.chip(width - grid.margin - grid.chip_width) if state.clock is not None else None,
        "message": message,
        "checklist": checklist,
        "bins": bins,
        "inventory": inventory,
        "minimap": minimap,
    }
    panels = {name: rect for name, rect in wanted.items() if rect is not None}
    return Layout(panels, grid.free(inventory), first, rows, bin_rows, lines)


def pointer_rect(angle: float, free: Rect, side: int) -> Rect:
    """Return the square at the edge of the free view in which the pointer is drawn.

    `angle` is the direction of the pointer in radians, counter-clockwise from the right.
    """
    half_width, half_height = (free.width - side) / 2.0, (free.height - side) / 2.0
    dx, dy = math.cos(angle), -math.sin(angle)
    reach = min(
        half_width / abs(dx) if abs(dx) > 1e-9 else math.inf,
        half_height / abs(dy) if abs(dy) > 1e-9 else math.inf,
    )
    x, y = round(free.x + half_width + reach * dx), round(free.y + half_height + reach * dy)
    return Rect(min(max(x, free.x), free.right - side), min(max(y, free.y), free.bottom - side), side, side)


def visible_rows(heights: Sequence[int], current: int, room: int) -> tuple[int, int]:
    """Return the index of the first visible row and the index after the last visible row.

    The current row, up to two rows before it, and as many other rows as fit into `room` pixels are visible.
    """
    first, stop, used = current, current + 1, heights[current]
    while first > max(0, current - CONTEXT_ROWS) and used + heights[first - 1] <= room // 2:
        first -= 1
        used += heights[first]
    while stop < len(heights) and used + heights[stop] <= room:
        used += heights[stop]
        stop += 1
    while first > 0 and used + heights[first - 1] <= room:
        first -= 1
        used += heights[first]
    return first, stop


def scrolled(heights: Sequence[int], first: int, room: int) -> tuple[int, int]:
    """Return the range of visible rows after the list was scrolled to row `first` or as far as possible."""
    ends = np.cumsum(heights)
    last_first = int(np.searchsorted(ends, ends[-1] - room)) + 1 if ends[-1] > room else 0
    first = min(max(first, 0), last_first, len(heights) - 1)
    start = int(ends[first]) - heights[first]
    return first, max(first + 1, int(np.searchsorted(ends, start + room, side="right")))


def _current_row(items: Sequence[ChecklistItem]) -> int:
    last = len(items) - 1 if items[-1].number is not None else 0
    return next((i for i, item in enumerate(items) if item.current), last)


class _PanelGrid:
    def __init__(self, width: int, height: int, typeface: Typeface, beside: bool) -> None:
        self._width, self._height = width, height
        self._typeface, px = typeface, typeface.px
        self._px = px
        self.margin, self._gap = px(theme.MARGIN), px(theme.GAP)
        self.chip_width, self._chip_height = px(theme.CHIP_WIDTH), px(theme.CHIP_HEIGHT)
        wide = width / unit_of(width, height) >= 760
        bins_width = theme.BINS_WIDTH_WIDE if wide else theme.BINS_WIDTH
        self._list_width = min(math.floor(theme.LIST_SHARE * width), px(theme.MAX_LIST_WIDTH))
        self._bins_width = px(theme.BINS_WIDTH_BESIDE if beside else bins_width)
        self._bins_left = width - self.margin - self._bins_width
        self._top = self.margin + self._chip_height + self._gap
        self._column_height = height - px(theme.LIST_BOTTOM) - self._top
        self._left = self.margin + self._list_width + self._gap  # left edge of the space between the lists
        self._between = self._bins_left - self._gap - self._left

    def chip(self, x: int) -> Rect:
        return Rect(x, self.margin, self.chip_width, self._chip_height)

    def checklist(
        self, items: tuple[ChecklistItem, ...], scroll: int
    ) -> tuple[Rect | None, int, tuple[ListRow, ...]]:
        if not items:
            return None, 0, ()
        rows = tuple(self._list_row(item) for item in items)
        heights = [row.height for row in rows]
        fixed = self._px(theme.HEADER) + self._px(theme.PADDING)
        if fixed + sum(heights) > self._column_height:
            fixed += self._px(theme.FOOTER)
        room = self._column_height - fixed
        first, stop = visible_rows(heights, _current_row(items), room)
        if scroll:
            first, stop = scrolled(heights, first + scroll, room)
        height = fixed + sum(heights[first:stop])
        return Rect(self.margin, self._top, self._list_width, height), first, rows[first:stop]

    def _list_row(self, item: ChecklistItem) -> ListRow:
        taken = 2 * theme.PADDING + 2 + theme.TILE + theme.GAP + (0 if item.number is None else theme.NUMBER)
        if item.target_picture is not None:
            taken += theme.TARGET + 3
        width = self._list_width - self._px(taken)
        detail = self._typeface.paragraph(item.detail, theme.DETAIL, width, 2 if item.done else 4)
        return ListRow(self._px(theme.ROW + theme.LINE * max(0, len(detail) - 1)), width, detail)

    def minimap(self, minimap: MiniMap | None) -> Rect | None:
        if minimap is None:
            return None
        inset = 2 * self._px(theme.MAP_INSET)
        xmin, ymin, xmax, ymax = minimap.bounds
        inner = round((self._bins_width - inset) * (ymax - ymin) / (xmax - xmin))
        height = min(max(inner, 1), self._px(theme.MAX_MAP_HEIGHT)) + inset
        return Rect(self._bins_left, self._height - self.margin - height, self._bins_width, height)

    def bins(
        self, entries: tuple[BinEntry, ...], below: Rect | None
    ) -> tuple[Rect | None, tuple[ListRow, ...]]:
        if not entries:
            return None, ()
        px = self._px
        room = self._column_height if below is None else below.y - self._gap - self._top
        width = self._bins_width - px(2 * theme.PADDING + theme.BIN_TILE + theme.GAP)
        fixed = px(theme.HEADER) + px(theme.PADDING)
        rows: tuple[ListRow, ...] = ()
        for lines in (3, 2, 1, 0):
            places = [
                self._typeface.wrap(b.place, theme.DETAIL, width, lines) if lines else () for b in entries
            ]
            heights = [px(max(theme.BIN_TILE, theme.BIN_LINE * (1 + len(p))) + theme.BIN_GAP) for p in places]
            rows = tuple(ListRow(height, width, place) for height, place in zip(heights, places, strict=True))
            if fixed + sum(heights) <= room:
                break
        while len(rows) > 1 and fixed + sum(row.height for row in rows) > room:
            rows = rows[:-1]
        height = fixed + sum(row.height for row in rows)
        return Rect(self._bins_left, self._top, self._bins_width, height), rows

    def inventory(self) -> Rect:
        px = self._px
        span = self._bins_left - self._gap - self.margin
        width = min(2 * px(theme.SLOT_WIDTH) + px(theme.BETWEEN_HANDS), span)
        height = px(theme.SLOT_HEIGHT)
        return Rect(
            self._centred(width, self.margin, span),
            self._height - self.margin - height,
            width,
            height,
        )

    def message(self, message: Message | None) -> tuple[Rect | None, tuple[str, ...]]:
        """Return the rectangle of the message bar, and its lines of text. Long text has up to three lines."""
        if message is None or message.opacity <= 0.0 or not message.text.strip():
            return None, ()
        face, extra = theme.BAR, self._px(theme.MESSAGE_ICON + 2 * theme.PADDING)
        left = self.margin + self.chip_width + self._gap
        span = self._width - 2 * left
        line = self._typeface.fit(message.text, face, span - extra)
        lines: tuple[str, ...] = (line,)
        if line != " ".join(message.text.split()):
            left, span = self._left, self._between
            lines = self._typeface.wrap(message.text, face, span - extra, theme.MESSAGE_LINES)
        width = min(span, extra + max(self._typeface.width(text, face) for text in lines))
        height = self._chip_height + (len(lines) - 1) * self._px(theme.LINE + 3)
        return Rect(self._centred(width, left, span), self.margin, width, height), lines

    def free(self, inventory: Rect) -> Rect:
        top = self._top + (theme.MESSAGE_LINES - 1) * self._px(theme.LINE + 3)
        return Rect(self._left, top, self._between, inventory.y - self._gap - top)

    def _centred(self, width: int, left: int, span: int) -> int:
        return min(max((self._width - width) // 2, left), left + span - width)
