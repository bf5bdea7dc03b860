"""Where each panel goes. Lengths are px of a 640 x 480 frame, scaled by `unit`; nothing overlaps.

progress        message bar         clock
task list                            bins
  ...             (free view)         ...
  ...              inventory          mini-map
"""

import math
from dataclasses import dataclass

from hud import theme
from hud.canvas import Rect
from hud.errors import FrameError
from hud.rows import (
    BETWEEN_HANDS,
    BINS_WIDTH,
    BINS_WIDTH_WIDE,
    CHIP_HEIGHT,
    CHIP_WIDTH,
    FOOTER,
    GAP,
    HEADER,
    LINE,
    LIST_BOTTOM,
    LIST_SHARE,
    LIST_WIDTH_LIMIT,
    MAP_HEIGHT,
    MAP_INSET,
    MARGIN,
    MESSAGE_ICON,
    MESSAGE_LINES,
    NUMBER,
    PADDING,
    POINTER,
    ROW,
    SLOT_HEIGHT,
    SLOT_WIDTH,
    SMALLEST,
    TARGET,
    TILE,
    BinRow,
    ListRow,
    focus,
    window,
)
from hud.state import ChecklistItem, HudState, Message, MiniMap
from hud.text import Typeface
from hud.theme import Face


@dataclass(frozen=True)
class Layout:
    """Rectangles of the panels in a frame, and what fits into them.

    Attributes:
        unit: Frame px per theme px.
        checklist: Task list, or None when it is empty.
        first: Index of the first row shown.
        stop: One past the last row shown.
        rows: Those rows.
        message_lines: The message, broken into lines.
        bin_rows: One per bin that is shown.
        free: The part of the view between the panels.
    """

    width: int
    height: int
    unit: float
    progress: Rect | None
    clock: Rect | None
    message: Rect | None
    checklist: Rect | None
    bins: Rect | None
    inventory: Rect
    pointer: Rect | None
    free: Rect
    first: int
    stop: int
    rows: tuple[ListRow, ...]
    message_lines: tuple[str, ...]
    bin_rows: tuple[BinRow, ...]
    minimap: Rect | None = None

    def panels(self) -> dict[str, Rect]:
        """Rectangles of the panels that are shown, by name."""
        names = ("progress", "clock", "message", "checklist", "bins", "inventory", "minimap", "pointer")
        return {name: rect for name in names if (rect := getattr(self, name)) is not None}


def unit_of(width: int, height: int) -> float:
    """Frame px per theme px: the frame always has room for 640 x 480 theme px.

    Raises:
        FrameError: The frame is too small to be read.
    """
    if width < SMALLEST[0] or height < SMALLEST[1]:
        raise FrameError(
            f"frame of {width} x {height} px is too small for the HUD; use {SMALLEST[0]} x {SMALLEST[1]}"
        )
    return min(width / 640.0, height / 480.0)


def arrange(state: HudState, width: int, height: int, face: Typeface) -> Layout:
    """Lay out the panels of `state` in a frame of `width` x `height` px.

    Raises:
        FrameError: The frame is too small to be read.
    """
    unit = unit_of(width, height)
    bounds = _Bounds(width, height, unit, face)
    checklist, first, rows = bounds.checklist(state)
    minimap = bounds.minimap(state.minimap)
    bins, bin_rows = bounds.bins(state, minimap)
    progress = Rect(bounds.margin, bounds.margin, bounds.px(CHIP_WIDTH), bounds.px(CHIP_HEIGHT))
    clock = Rect(
        width - bounds.margin - bounds.px(CHIP_WIDTH), bounds.margin, progress.width, progress.height
    )
    inventory = bounds.inventory()
    message, lines = bounds.message(state.message)
    free = bounds.free(inventory)
    return Layout(
        width=width,
        height=height,
        unit=unit,
        progress=progress if state.total > 0 else None,
        clock=clock if state.clock is not None else None,
        message=message,
        checklist=checklist,
        bins=bins,
        inventory=inventory,
        pointer=None if state.pointer is None else pointer_rect(state.pointer.angle, free, unit),
        free=free,
        first=first,
        stop=first + len(rows),
        rows=rows,
        message_lines=lines,
        bin_rows=bin_rows,
        minimap=minimap,
    )


@dataclass(frozen=True)
class _Bounds:
    """A frame and its scale."""

    width: int
    height: int
    unit: float
    face: Typeface

    def px(self, size: float) -> int:
        return round(size * self.unit)

    @property
    def margin(self) -> int:
        return self.px(MARGIN)

    @property
    def top(self) -> int:
        """Where the columns begin."""
        return self.margin + self.px(CHIP_HEIGHT) + self.px(GAP)

    @property
    def list_width(self) -> int:
        return min(math.floor(LIST_SHARE * self.width), self.px(LIST_WIDTH_LIMIT))

    @property
    def bins_width(self) -> int:
        return self.px(BINS_WIDTH_WIDE if self.width / self.unit >= 760 else BINS_WIDTH)

    @property
    def column_height(self) -> int:
        return self.height - self.px(LIST_BOTTOM) - self.top

    @property
    def middle(self) -> tuple[int, int]:
        """First column and width of the part between the two lists."""
        left = self.margin + self.list_width + self.px(GAP)
        return left, self.width - self.margin - self.bins_width - self.px(GAP) - left

    def checklist(self, state: HudState) -> tuple[Rect | None, int, tuple[ListRow, ...]]:
        """Rectangle of the task list, its first row and the rows it shows; never more than fit."""
        if not state.checklist:
            return None, 0, ()
        rows = tuple(self.list_row(item) for item in state.checklist)
        heights = [row.height for row in rows]
        fixed = self.px(HEADER) + self.px(PADDING)
        if fixed + sum(heights) > self.column_height:
            fixed += self.px(FOOTER)
        first, stop = window(heights, focus(state), self.column_height - fixed)
        height = fixed + sum(heights[first:stop])
        return Rect(self.margin, self.top, self.list_width, height), first, rows[first:stop]

    def list_row(self, item: ChecklistItem) -> ListRow:
        """Measure a row: more lines of detail where one is too short for what is still to be done."""
        taken = 2 * PADDING + 2 + TILE + GAP + (0 if item.number is None else NUMBER)
        if item.target_picture is not None:
            taken += TARGET + 3
        width = self.list_width - self.px(taken)
        size = max(1, self.px(theme.DETAIL.size))
        detail = self.face.paragraph(item.detail, size, theme.DETAIL.weight, width, 1 if item.done else 3)
        return ListRow(self.px(ROW + LINE * max(0, len(detail) - 1)), width, detail)

    def minimap(self, minimap: MiniMap | None) -> Rect | None:
        """As wide as the list of bins, in the lower right corner, in the proportions of the house."""
        if minimap is None:
            return None
        inset = 2 * self.px(MAP_INSET)
        xmin, ymin, xmax, ymax = minimap.bounds
        inner = round((self.bins_width - inset) * (ymax - ymin) / (xmax - xmin))
        height = min(max(inner, 1), self.px(MAP_HEIGHT)) + inset
        return Rect(
            self.width - self.margin - self.bins_width,
            self.height - self.margin - height,
            self.bins_width,
            height,
        )

    def bins(self, state: HudState, below: Rect | None) -> tuple[Rect | None, tuple[BinRow, ...]]:
        """Rectangle of the list of bins and its rows; places get fewer lines when many bins must fit."""
        if not state.bins:
            return None, ()
        room = self.column_height if below is None else below.y - self.px(GAP) - self.top
        text = self.bins_width - self.px(2 * PADDING + TILE + GAP)
        size = max(1, self.px(theme.DETAIL.size))
        fixed = self.px(HEADER) + self.px(PADDING)
        rows: tuple[BinRow, ...] = ()
        for lines in (3, 2, 1, 0):
            wrapped = [
                self.face.paragraph(b.place, size, theme.DETAIL.weight, text, lines) if lines else ()
                for b in state.bins
            ]
            rows = tuple(BinRow(self.px(max(TILE, LINE * (1 + len(w))) + GAP), w) for w in wrapped)
            if fixed + sum(r.height for r in rows) <= room:
                break
        while len(rows) > 1 and fixed + sum(r.height for r in rows) > room:
            rows = rows[:-1]
        rect = Rect(
            self.width - self.margin - self.bins_width,
            self.top,
            self.bins_width,
            fixed + sum(r.height for r in rows),
        )
        return rect, rows

    def inventory(self) -> Rect:
        """Two slots at the bottom, apart from each other and centred in the frame."""
        left, room = self.middle
        width = min(2 * self.px(SLOT_WIDTH) + self.px(BETWEEN_HANDS), room)
        x = min(max((self.width - width) // 2, left), left + room - width)
        return Rect(x, self.height - self.margin - self.px(SLOT_HEIGHT), width, self.px(SLOT_HEIGHT))

    def message(self, message: Message | None) -> tuple[Rect | None, tuple[str, ...]]:
        """One line between the chips when the text fits there, else up to three lines between the lists."""
        if message is None or message.opacity <= 0.0 or not message.text.strip():
            return None, ()
        face: Face = theme.BAR
        size = max(1, self.px(face.size))
        extra = self.px(MESSAGE_ICON + 2 * PADDING)
        wide = self.width - 2 * (self.margin + self.px(CHIP_WIDTH) + self.px(GAP))
        line = self.face.fit(message.text, size, face.weight, wide - extra)
        if line == " ".join(message.text.split()):
            lines: tuple[str, ...] = (line,)
            left, span = self.margin + self.px(CHIP_WIDTH) + self.px(GAP), wide
        else:
            left, span = self.middle
            lines = self.face.wrap(message.text, size, face.weight, span - extra, MESSAGE_LINES)
        width = min(span, extra + max(self.face.width(text, size, face.weight) for text in lines))
        height = self.px(CHIP_HEIGHT) + (len(lines) - 1) * self.px(LINE + 3)
        x = min(max((self.width - width) // 2, left), left + span - width)
        return Rect(x, self.margin, width, height), lines

    def free(self, inventory: Rect) -> Rect:
        """The view between the lists, below the tallest message and above the inventory."""
        left, width = self.middle
        top = self.margin + self.px(CHIP_HEIGHT) + (MESSAGE_LINES - 1) * self.px(LINE + 3) + self.px(GAP)
        return Rect(left, top, width, inventory.y - self.px(GAP) - top)


def pointer_rect(angle: float, free: Rect, unit: float) -> Rect:
    """A square at the edge of the free view in direction `angle`, rad, counter-clockwise from the right."""
    side = round(POINTER * unit)
    half_width, half_height = (free.width - side) / 2.0, (free.height - side) / 2.0
    dx, dy = math.cos(angle), -math.sin(angle)
    reach = min(
        half_width / abs(dx) if abs(dx) > 1e-9 else math.inf,
        half_height / abs(dy) if abs(dy) > 1e-9 else math.inf,
    )
    x = free.x + half_width + reach * dx
    y = free.y + half_height + reach * dy
    return Rect(
        min(max(round(x), free.x), free.right - side),
        min(max(round(y), free.y), free.bottom - side),
        side,
        side,
    )
