"""Functions that draw all panels except the mini-map."""

import math

from hud import theme
from hud.canvas import Canvas, Patch, Rect
from hud.layout import ListRow
from hud.state import BinEntry, ChecklistItem, InventorySlot, MessageKind
from hud.stencils import Stencils
from hud.text import ELLIPSIS
from hud.texts import HudTexts, filled

POINTER_STEPS = 72  # number of directions of the pointer, 5 degrees apart


def draw_bins(
    stencils: Stencils, rect: Rect, title: str, bins: tuple[BinEntry, ...], rows: tuple[ListRow, ...]
) -> Patch:
    canvas = Canvas.panel(stencils, rect)
    px = canvas.px
    x = px(theme.PADDING + 2)
    canvas.text(x, px(17), title, theme.TITLE, theme.TEXT)
    top = px(theme.HEADER)
    text_x = x + px(theme.BIN_TILE + theme.GAP)
    for entry, row in zip(bins, rows, strict=False):
        canvas.tile(entry.picture, x, top + px(1), px(theme.BIN_TILE))
        width = rect.width - text_x - px(theme.PADDING)
        lift = 0 if row.detail else px(8)
        face = theme.LABEL
        if canvas.typeface.width(entry.label, face) > width:
            face = theme.Face(face.size - 1, face.weight)
        canvas.text(
            text_x, top + px(12) + lift, canvas.typeface.fit(entry.label, face, width), face, theme.TEXT
        )
        for i, line in enumerate(row.detail):
            canvas.text(text_x, top + px(12 + theme.BIN_LINE * (i + 1)), line, theme.DETAIL, theme.QUIET)
        top += row.height
    return canvas.patch()


def draw_inventory(
    stencils: Stencils,
    rect: Rect,
    slots: tuple[InventorySlot | None, InventorySlot],
    hands: tuple[str, str],
    empty: str,
) -> Patch:
    """Draw the contents of both hands. `hands` are the names of the hands. `empty` labels an empty hand."""
    canvas = Canvas(stencils, rect.width, rect.height)
    for slot, hand, at_the_left in zip(slots, hands, (True, False), strict=True):
        if slot is not None:
            _draw_hand(canvas, slot, (hand, empty), at_the_left)
    return canvas.patch()


def _draw_hand(canvas: Canvas, slot: InventorySlot, when_empty: tuple[str, str], at_the_left: bool) -> None:
    px = canvas.px
    held = slot.label is not None
    side = canvas.height - 2 * px(5)
    inset = px(5) + side + px(theme.GAP) if held else px(theme.PADDING + 1)
    face, colour = (theme.LABEL, theme.TEXT) if held else (theme.DETAIL, theme.QUIET)
    lines: tuple[str, ...] = ()
    # Only long names get the wider slot, because it hides more of the view.
    for size in (
        (theme.SLOT_WIDTH, theme.SLOT_WIDTH_LONG) if held else (theme.SLOT_WIDTH_EMPTY, theme.SLOT_WIDTH)
    ):
        width = min(px(size), (canvas.width - px(theme.GAP)) // 2)
        room = width - px(theme.PADDING) - inset
        if slot.label is None:
            lines = tuple(canvas.typeface.fit(line, face, room) for line in when_empty)
        else:
            lines = canvas.typeface.wrap(slot.label, face, room, 2)
        if not any(line.endswith(ELLIPSIS) for line in lines):
            break
    left = 0 if at_the_left else canvas.width - width
    area = Rect(left, 0, width, canvas.height)
    canvas.rounded(area, 8.0 * canvas.unit, theme.PANEL, theme.PANEL_OPACITY)
    edge, opacity = (theme.ACCENT, 0.9) if held else (theme.EDGE, theme.EDGE_OPACITY)
    canvas.rounded(
        area, 8.0 * canvas.unit, edge, opacity, line=max(1.0, canvas.unit * (1.5 if held else 1.0))
    )
    if held:
        canvas.tile(slot.picture, left + px(5), px(5), side)
    first = canvas.height // 2 + px(4.5) - px(theme.LINE) * (len(lines) - 1) // 2
    for number, line in enumerate(lines):
        canvas.text(
            left + inset, first + number * px(theme.LINE), canvas.typeface.fit(line, face, room), face, colour
        )


def draw_message(stencils: Stencils, rect: Rect, kind: MessageKind, lines: tuple[str, ...]) -> Patch:
    """Draw the message bar at full opacity."""
    canvas = Canvas.panel(stencils, rect)
    px = canvas.px
    tone = theme.TONES[kind]
    cx, cy, r = px(theme.PADDING) + px(10), rect.height / 2.0, 9.0 * canvas.unit
    canvas.circle(cx, cy, r, tone)
    u, stroke = canvas.unit, max(1.0, 1.8 * canvas.unit)
    if kind is MessageKind.SUCCESS:
        canvas.shape(
            [(cx - 4 * u, cy), (cx - u, cy + 3.5 * u), (cx + 4.5 * u, cy - 3.5 * u)], theme.TEXT, stroke
        )
    elif kind is MessageKind.REFUSAL:
        canvas.shape([(cx, cy - 5 * u), (cx, cy + 1 * u)], theme.TEXT, stroke * 1.2)
        canvas.circle(cx, cy + 4.5 * u, 1.4 * u, theme.TEXT)
    else:
        canvas.shape([(cx, cy - 1 * u), (cx, cy + 5 * u)], theme.PANEL, stroke * 1.2)
        canvas.circle(cx, cy - 4.5 * u, 1.4 * u, theme.PANEL)
    for i, line in enumerate(lines):
        canvas.text(px(theme.PADDING + 26), px(19) + i * px(theme.LINE + 3), line, theme.BAR, theme.TEXT)
    return canvas.patch()


def draw_progress(stencils: Stencils, rect: Rect, delivered: int, total: int) -> Patch:
    canvas = Canvas.panel(stencils, rect)
    px = canvas.px
    text = canvas.typeface.fit(f"{delivered} / {total}", theme.CHIP, rect.width - px(8))
    canvas.text(
        (rect.width - canvas.typeface.width(text, theme.CHIP)) // 2, px(17), text, theme.CHIP, theme.TEXT
    )
    track = Rect(px(10), rect.height - px(7), rect.width - 2 * px(10), max(2, px(3)))
    canvas.rounded(track, track.height / 2, theme.EDGE, 0.25)
    done = round(track.width * min(delivered, total) / max(total, 1))
    if done > 0:
        bar = Rect(track.x, track.y, max(done, track.height), track.height)
        canvas.rounded(bar, track.height / 2, theme.PROGRESS, 1.0)
    return canvas.patch()


def clock_text(seconds: float) -> str:
    """Format a time in seconds as m:ss, or as h:mm:ss if it is at least one hour."""
    whole = max(0, math.floor(seconds))
    hours, minutes = divmod(whole // 60, 60)
    return f"{hours}:{minutes:02d}:{whole % 60:02d}" if hours else f"{minutes}:{whole % 60:02d}"


def draw_clock(stencils: Stencils, rect: Rect, text: str) -> Patch:
    canvas = Canvas.panel(stencils, rect)
    px, u = canvas.px, canvas.unit
    width = canvas.typeface.width(text, theme.CHIP)
    x = (rect.width - width - px(18)) // 2
    cx, cy = x + 6.5 * u, rect.height / 2.0
    canvas.circle(cx, cy, 6.5 * u, theme.QUIET)
    canvas.circle(cx, cy, 5.2 * u, theme.PANEL)
    canvas.shape([(cx, cy - 3.6 * u), (cx, cy), (cx + 2.8 * u, cy)], theme.QUIET, max(1.0, 1.2 * u))
    canvas.text(x + px(18), px(19), text, theme.CHIP, theme.TEXT)
    return canvas.patch()


def draw_pointer(stencils: Stencils, rect: Rect, step: int) -> Patch:
    """Draw an arrow on a disc. `step` is its direction in units of 5 degrees, where 0 points right."""
    canvas = Canvas(stencils, rect.width, rect.height)
    centre, u = rect.width / 2.0, canvas.unit
    canvas.circle(centre, centre, 16.5 * u, theme.TEXT, 0.9)
    canvas.circle(centre, centre, 15.0 * u, theme.PANEL, 0.9)
    outline = ((11.0, 0.0), (-5.0, -8.0), (-2.0, 0.0), (-5.0, 8.0))
    canvas.arrow(centre, 2.0 * math.pi * step / POINTER_STEPS, outline, u, theme.ACCENT)
    return canvas.patch()


def count_text(items: tuple[ChecklistItem, ...], texts: HudTexts) -> str:
    left = sum(not item.done for item in items)
    if any(item.number is not None for item in items):
        number = len(items) - left + 1
        return filled(texts.next_step, number=number, count=len(items)) if left else texts.done
    if left:
        return filled(texts.left, count=left)
    carried = sum(item.carried for item in items)
    return filled(texts.none_left_carried, count=carried) if carried else texts.none_left


def hidden_text(above: int, more: int, texts: HudTexts) -> str:
    """Return a note with the numbers of hidden rows above and below the visible rows."""
    notes = (
        filled(texts.above, count=above) if above else "",
        filled(texts.more, count=more) if more else "",
    )
    return " · ".join(note for note in notes if note)


def draw_checklist(
    stencils: Stencils,
    rect: Rect,
    header: tuple[str, str],
    items: tuple[ChecklistItem, ...],
    rows: tuple[ListRow, ...],
    hidden: str,
) -> Patch:
    """Draw the task list. `header` is the title and the count, and `hidden` is a note about hidden rows."""
    canvas = Canvas.panel(stencils, rect)
    px, width = canvas.px, canvas.typeface.width
    title, count = header
    x = px(theme.PADDING + 2)
    right = canvas.width - x
    taken = width(count, theme.DETAIL) + px(theme.GAP)
    line = canvas.typeface.fit(title, theme.TITLE, right - x - taken)
    canvas.text(x, px(17), line, theme.TITLE, theme.TEXT)
    canvas.text(right - taken + px(theme.GAP), px(17), count, theme.DETAIL, theme.QUIET)
    top = round(theme.HEADER * canvas.unit)
    for item, row in zip(items, rows, strict=True):
        _draw_row(canvas, item, row, top)
        top += row.height
    text = canvas.typeface.fit(hidden, theme.DETAIL, right - x)
    canvas.text(x, canvas.height - px(theme.PADDING), text, theme.DETAIL, theme.QUIET)
    return canvas.patch()


def _draw_row(canvas: Canvas, item: ChecklistItem, row: ListRow, top: int) -> None:
    px, side = canvas.px, canvas.px(theme.TILE)
    if item.current:
        area = Rect(px(3), top, canvas.width - 2 * px(3), row.height)
        canvas.rounded(area, 5.0 * canvas.unit, theme.ACCENT, 0.16)
        bar = Rect(px(2), top + px(4), px(3), row.height - 2 * px(4))
        canvas.rounded(bar, 1.5 * canvas.unit, theme.ACCENT, 1.0)
    x = px(theme.PADDING + 2)
    if item.number is not None:
        label, face = str(item.number), theme.LABEL if item.current else theme.DETAIL
        right = x + px(theme.NUMBER) - px(3)
        canvas.text(right - canvas.typeface.width(label, face), top + px(21), label, face, theme.QUIET)
        x += px(theme.NUMBER)
    canvas.tile(item.picture, x, top + px(3), side, 0.5 if item.done else 1.0)
    if item.target_picture is not None:
        small = px(theme.TARGET)
        left = canvas.width - px(theme.PADDING) - small
        canvas.tile(item.target_picture, left, top + px(5), small, 0.4 if item.done else 1.0)
    _draw_text(canvas, item, row, x + side + px(theme.GAP), top)


def _draw_text(canvas: Canvas, item: ChecklistItem, row: ListRow, x: int, top: int) -> None:
    px = canvas.px
    face = theme.ITEM_CURRENT if item.current else theme.ITEM
    if canvas.typeface.width(item.text, face) > row.text_width:
        face = theme.Face(theme.DETAIL.size, face.weight)
    line = canvas.typeface.fit(item.text, face, row.text_width)
    baseline = top + (px(15) if row.detail else px(22))
    drawn = canvas.text(x, baseline, line, face, theme.DONE if item.done else theme.TEXT)
    if item.done and drawn > 0:
        y = baseline - px(4.5)
        canvas.shape([(x - px(1), y), (x + drawn + px(1), y)], theme.TEXT, line=max(1.0, 1.2 * px(1)))
    for i, detail in enumerate(row.detail):
        baseline = top + px(28 + theme.LINE * i)
        canvas.text(x, baseline, detail, theme.DETAIL, theme.DONE if item.done else theme.QUIET)
