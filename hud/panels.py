"""Drawing of each panel: values in, a patch out."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hud import theme
from hud.canvas import Canvas, Patch, Rect
from hud.rows import (
    EMPTY_WIDTH,
    GAP,
    HEADER,
    LINE,
    NUMBER,
    PADDING,
    SLOT_WIDTH,
    TARGET,
    TILE,
    BinRow,
    ListRow,
)
from hud.state import BinEntry, ChecklistItem, InventorySlot, Message, MessageKind
from hud.text import Typeface

Pictures = Mapping[str, NDArray[np.uint8]]


@dataclass(frozen=True, eq=False)
class Pen:
    """What every panel is drawn with."""

    face: Typeface
    unit: float
    pictures: Pictures

    def panel(self, rect: Rect, radius: float = 8.0) -> Canvas:
        """A canvas of the size of `rect` with the dark rounded background."""
        canvas = Canvas(rect.width, rect.height, self.face, self.unit)
        whole = Rect(0, 0, rect.width, rect.height)
        canvas.rounded(whole, radius * self.unit, theme.PANEL, theme.PANEL_OPACITY)
        canvas.rounded(whole, radius * self.unit, theme.EDGE, theme.EDGE_OPACITY, line=max(1.0, self.unit))
        return canvas

    def tile(self, canvas: Canvas, key: str | None, x: int, y: int, size: int, opacity: float = 1.0) -> None:
        """A picture on a light rounded tile; an unknown key leaves the tile empty."""
        canvas.rounded(Rect(x, y, size, size), 4.0 * self.unit, theme.TILE, 0.94 * opacity)
        picture = self.pictures.get(key) if key is not None else None
        if picture is not None:
            inset = canvas.px(1)
            canvas.picture(picture, x + inset, y + inset, size - 2 * inset, opacity)


def count_text(items: tuple[ChecklistItem, ...]) -> str:
    """What is left of a list, or which step of a numbered one is next."""
    left = sum(not item.done for item in items)
    if any(item.number is not None for item in items):
        return f"step {len(items) - left + 1} / {len(items)}" if left else "done"
    return f"{left} left" if left else "none left"


def draw_checklist(
    pen: Pen,
    rect: Rect,
    title: str,
    items: tuple[ChecklistItem, ...],
    rows: tuple[ListRow, ...],
    hidden: tuple[int, int],
    count: str,
) -> Patch:
    """The task list: the items that fit, how many are hidden before and after them, and a count beside the title."""
    canvas = pen.panel(rect)
    x, width = canvas.px(PADDING + 2), rect.width - 2 * canvas.px(PADDING + 2)
    taken = canvas.text_width(count, theme.DETAIL) + canvas.px(GAP)
    canvas.text(x, canvas.px(17), canvas.fit(title, theme.TITLE, width - taken), theme.TITLE, theme.TEXT)
    canvas.text(rect.width - x - taken + canvas.px(GAP), canvas.px(17), count, theme.DETAIL, theme.QUIET)
    top = canvas.px(HEADER)
    for item, row in zip(items, rows, strict=True):
        _checklist_row(pen, canvas, item, row, top)
        top += row.height
    notes = (f"{hidden[0]} above" if hidden[0] else "", f"+{hidden[1]} more" if hidden[1] else "")
    footer = canvas.fit(" · ".join(note for note in notes if note), theme.DETAIL, width)
    canvas.text(x, rect.height - canvas.px(PADDING), footer, theme.DETAIL, theme.QUIET)
    return canvas.patch()


def _checklist_row(pen: Pen, canvas: Canvas, item: ChecklistItem, row: ListRow, top: int) -> None:
    px = canvas.px
    side = px(TILE)
    if item.current:
        area = Rect(px(3), top, canvas.width - 2 * px(3), row.height)
        canvas.rounded(area, 5.0 * pen.unit, theme.ACCENT, 0.16)
        canvas.rounded(
            Rect(px(2), top + px(4), px(3), row.height - 2 * px(4)), 1.5 * pen.unit, theme.ACCENT, 1.0
        )
    x = px(PADDING + 2)
    if item.number is not None:
        label = str(item.number)
        right = x + px(NUMBER) - px(3)
        face = theme.LABEL if item.current else theme.DETAIL
        canvas.text(right - canvas.text_width(label, face), top + px(19), label, face, theme.QUIET)
        x += px(NUMBER)
    pen.tile(canvas, item.picture, x, top + px(3), side, 0.5 if item.done else 1.0)
    if item.target_picture is not None:
        small = px(TARGET)
        left = canvas.width - px(PADDING) - small
        pen.tile(canvas, item.target_picture, left, top + px(5), small, 0.4 if item.done else 1.0)
    _row_text(canvas, item, row, x + side + px(GAP), top)


def _row_text(canvas: Canvas, item: ChecklistItem, row: ListRow, x: int, top: int) -> None:
    px = canvas.px
    face = theme.ITEM_CURRENT if item.current else theme.ITEM
    if canvas.text_width(item.text, face) > row.text_width:
        face = theme.Face(theme.DETAIL.size, face.weight)
    line = canvas.fit(item.text, face, row.text_width)
    baseline = top + (px(13) if row.detail else px(19))
    drawn = canvas.text(x, baseline, line, face, theme.DONE if item.done else theme.TEXT)
    if item.done and drawn > 0:
        y = baseline - px(4.5)
        canvas.shape([(x - px(1), y), (x + drawn + px(1), y)], theme.TEXT, line=max(1.0, 1.2 * px(1)))
    for i, detail in enumerate(row.detail):
        canvas.text(
            x, top + px(26 + LINE * i), detail, theme.DETAIL, theme.DONE if item.done else theme.QUIET
        )


def draw_bins(
    pen: Pen, rect: Rect, bins: tuple[BinEntry, ...], rows: tuple[BinRow, ...], hidden: int
) -> Patch:
    """The list of bins: picture, name and place."""
    canvas = pen.panel(rect)
    px = canvas.px
    x = px(PADDING + 2)
    canvas.text(x, px(17), f"Bins (+{hidden})" if hidden else "Bins", theme.TITLE, theme.TEXT)
    top = px(HEADER)
    text_x = x + px(TILE + GAP)
    for entry, row in zip(bins, rows, strict=False):
        pen.tile(canvas, entry.picture, x, top + px(1), px(TILE))
        width = rect.width - text_x - px(PADDING)
        lift = 0 if row.place else px(5)
        face = theme.LABEL
        if canvas.text_width(entry.label, face) > width:
            face = theme.Face(face.size - 1, face.weight)
        canvas.text(text_x, top + px(11) + lift, canvas.fit(entry.label, face, width), face, theme.TEXT)
        for i, line in enumerate(row.place):
            canvas.text(text_x, top + px(11 + LINE * (i + 1)), line, theme.DETAIL, theme.QUIET)
        top += row.height
    return canvas.patch()


def draw_inventory(pen: Pen, rect: Rect, slots: tuple[InventorySlot, InventorySlot]) -> Patch:
    """Two hands, at the left and the right end: a picture and a name each, or a word that it is empty."""
    canvas = Canvas(rect.width, rect.height, pen.face, pen.unit)
    px = canvas.px
    for i, (slot, hand) in enumerate(zip(slots, ("Left hand", "Right hand"), strict=True)):
        held = slot.label is not None
        width = min(px(SLOT_WIDTH if held else EMPTY_WIDTH), (rect.width - px(GAP)) // 2)
        left = 0 if i == 0 else rect.width - width
        area = Rect(left, 0, width, rect.height)
        canvas.rounded(area, 8.0 * pen.unit, theme.PANEL, theme.PANEL_OPACITY)
        edge, opacity = (theme.ACCENT, 0.9) if held else (theme.EDGE, theme.EDGE_OPACITY)
        canvas.rounded(area, 8.0 * pen.unit, edge, opacity, line=max(1.0, pen.unit * (1.5 if held else 1.0)))
        x = left + px(PADDING + 1)
        if slot.label is not None:
            side = rect.height - 2 * px(5)
            pen.tile(canvas, slot.picture, left + px(5), px(5), side)
            x = left + px(5) + side + px(GAP)
        room = left + width - px(PADDING) - x
        if slot.label is not None:
            lines, face, colour = canvas.wrap(slot.label, theme.LABEL, room, 2), theme.LABEL, theme.TEXT
        else:
            lines, face, colour = (hand, "empty"), theme.DETAIL, theme.QUIET
        first = rect.height // 2 + px(4.5) - px(LINE) * (len(lines) - 1) // 2
        for line_number, line in enumerate(lines):
            line_top = first + line_number * px(LINE)
            canvas.text(x, line_top, canvas.fit(line, face, room), face, colour)
    return canvas.patch()


def draw_message(pen: Pen, rect: Rect, message: Message, lines: tuple[str, ...]) -> Patch:
    """The message bar at full opacity: a symbol in the colour of its tone, and the text."""
    canvas = pen.panel(rect)
    px = canvas.px
    tone = theme.TONES[message.kind]
    cx, cy, r = px(PADDING) + px(10), rect.height / 2.0, 9.0 * pen.unit
    canvas.circle(cx, cy, r, tone)
    stroke = max(1.0, 1.8 * pen.unit)
    u = pen.unit
    if message.kind is MessageKind.SUCCESS:
        canvas.shape(
            [(cx - 4 * u, cy), (cx - u, cy + 3.5 * u), (cx + 4.5 * u, cy - 3.5 * u)], theme.TEXT, stroke
        )
    elif message.kind is MessageKind.REFUSAL:
        canvas.shape([(cx, cy - 5 * u), (cx, cy + 1 * u)], theme.TEXT, stroke * 1.2)
        canvas.circle(cx, cy + 4.5 * u, 1.4 * u, theme.TEXT)
    else:
        canvas.shape([(cx, cy - 1 * u), (cx, cy + 5 * u)], theme.PANEL, stroke * 1.2)
        canvas.circle(cx, cy - 4.5 * u, 1.4 * u, theme.PANEL)
    for i, line in enumerate(lines):
        canvas.text(px(PADDING + 26), px(19) + i * px(LINE + 3), line, theme.BAR, theme.TEXT)
    return canvas.patch()


def draw_progress(pen: Pen, rect: Rect, delivered: int, total: int) -> Patch:
    """How many objects are where they belong, as a number and as a bar."""
    canvas = pen.panel(rect)
    px = canvas.px
    text = canvas.fit(f"{delivered} / {total}", theme.CHIP, rect.width - px(8))
    canvas.text((rect.width - canvas.text_width(text, theme.CHIP)) // 2, px(17), text, theme.CHIP, theme.TEXT)
    track = Rect(px(10), rect.height - px(7), rect.width - 2 * px(10), max(2, px(3)))
    canvas.rounded(track, track.height / 2, theme.EDGE, 0.25)
    done = round(track.width * min(delivered, total) / max(total, 1))
    if done > 0:
        bar = Rect(track.x, track.y, max(done, track.height), track.height)
        canvas.rounded(bar, track.height / 2, theme.PROGRESS, 1.0)
    return canvas.patch()


def clock_text(seconds: float) -> str:
    """Elapsed time as m:ss, or h:mm:ss from one hour on."""
    whole = max(0, math.floor(seconds))
    hours, minutes = divmod(whole // 60, 60)
    return f"{hours}:{minutes:02d}:{whole % 60:02d}" if hours else f"{minutes}:{whole % 60:02d}"


def draw_clock(pen: Pen, rect: Rect, text: str) -> Patch:
    """Elapsed time beside a small dial."""
    canvas = pen.panel(rect)
    px, u = canvas.px, pen.unit
    width = canvas.text_width(text, theme.CHIP)
    x = (rect.width - width - px(18)) // 2
    cx, cy = x + 6.5 * u, rect.height / 2.0
    canvas.circle(cx, cy, 6.5 * u, theme.QUIET)
    canvas.circle(cx, cy, 5.2 * u, theme.PANEL)
    canvas.shape([(cx, cy - 3.6 * u), (cx, cy), (cx + 2.8 * u, cy)], theme.QUIET, max(1.0, 1.2 * u))
    canvas.text(x + px(18), px(19), text, theme.CHIP, theme.TEXT)
    return canvas.patch()


def draw_pointer(pen: Pen, rect: Rect, angle: float) -> Patch:
    """A disc with an arrow in direction `angle`, rad, counter-clockwise from the right."""
    canvas = Canvas(rect.width, rect.height, pen.face, pen.unit)
    centre, u = rect.width / 2.0, pen.unit
    canvas.circle(centre, centre, 16.5 * u, theme.TEXT, 0.9)
    canvas.circle(centre, centre, 15.0 * u, theme.PANEL, 0.9)
    c, s = math.cos(angle), -math.sin(angle)
    outline = ((11.0, 0.0), (-5.0, -8.0), (-2.0, 0.0), (-5.0, 8.0))
    canvas.shape(
        [(centre + u * (a * c - b * s), centre + u * (a * s + b * c)) for a, b in outline], theme.ACCENT
    )
    return canvas.patch()
