"""Drawing of the small panels: values in, a patch out. The task list is in `hud.checklist`."""

import math

from hud import theme
from hud.canvas import Canvas, Patch, Rect
from hud.layout import ListRow
from hud.state import BinEntry, InventorySlot, MessageKind
from hud.stencils import Stencils
from hud.text import ELLIPSIS

POINTER_STEPS = 72  # drawn directions of the pointer, 5 degrees apart


def draw_bins(
    stencils: Stencils, rect: Rect, title: str, bins: tuple[BinEntry, ...], rows: tuple[ListRow, ...]
) -> Patch:
    """The list of bins: a title, and picture, name and place of each."""
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
    """The hands, at the left and the right end: a picture and a name each, or a word that it is empty."""
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
    # A long name gets a wider slot at the cost of the view between the hands.
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
    """The message bar at full opacity: a symbol in the colour of its tone, and the text."""
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
    """How many objects are where they belong, as a number and as a bar."""
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
    """Elapsed time as m:ss, or h:mm:ss from one hour on."""
    whole = max(0, math.floor(seconds))
    hours, minutes = divmod(whole // 60, 60)
    return f"{hours}:{minutes:02d}:{whole % 60:02d}" if hours else f"{minutes}:{whole % 60:02d}"


def draw_clock(stencils: Stencils, rect: Rect, text: str) -> Patch:
    """Elapsed time beside a small dial."""
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
    """A disc with an arrow; `step` of `POINTER_STEPS` directions, counter-clockwise from the right."""
    canvas = Canvas(stencils, rect.width, rect.height)
    centre, u = rect.width / 2.0, canvas.unit
    canvas.circle(centre, centre, 16.5 * u, theme.TEXT, 0.9)
    canvas.circle(centre, centre, 15.0 * u, theme.PANEL, 0.9)
    outline = ((11.0, 0.0), (-5.0, -8.0), (-2.0, 0.0), (-5.0, 8.0))
    canvas.arrow(centre, 2.0 * math.pi * step / POINTER_STEPS, outline, u, theme.ACCENT)
    return canvas.patch()
