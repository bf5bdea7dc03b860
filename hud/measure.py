"""How large each panel of a state is in a frame, and what fits into it."""

import math
from dataclasses import dataclass

from hud import theme
from hud.canvas import Rect
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
    ROW,
    SLOT_HEIGHT,
    SLOT_WIDTH,
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
class Measure:
    """A frame and its scale: where each panel would go in it, and what fits.

    Lengths in `hud.rows` are px of a 640 x 480 frame; `unit` is frame px per such px.
    """

    width: int
    height: int
    unit: float
    face: Typeface

    def px(self, size: float) -> int:
        """Theme px to frame px."""
        return round(size * self.unit)

    @property
    def margin(self) -> int:
        """Between the panels and the edge of the frame."""
        return self.px(MARGIN)

    @property
    def top(self) -> int:
        """Where the columns begin."""
        return self.margin + self.px(CHIP_HEIGHT) + self.px(GAP)

    @property
    def list_width(self) -> int:
        """Width of the task list."""
        return min(math.floor(LIST_SHARE * self.width), self.px(LIST_WIDTH_LIMIT))

    @property
    def bins_width(self) -> int:
        """Width of the list of bins."""
        return self.px(BINS_WIDTH_WIDE if self.width / self.unit >= 760 else BINS_WIDTH)

    @property
    def column_height(self) -> int:
        """Height that a list may take."""
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
