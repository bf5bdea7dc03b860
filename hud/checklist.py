"""Drawing of the task list, row by row: from one state to the next few rows change, and the others are kept."""

import functools

from hud import theme
from hud.canvas import Canvas, Patch, Rect
from hud.pen import Pen
from hud.rows import GAP, HEADER, LINE, NUMBER, PADDING, TARGET, TILE, ListRow
from hud.state import ChecklistItem


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
    top = round(HEADER * pen.unit)
    strips = [pen.strip(rect, 0, top, ("header", title, count), lambda canvas: _header(canvas, title, count))]
    for item, row in zip(items, rows, strict=True):
        draw = functools.partial(_row, pen, item=item, row=row)
        strips.append(pen.strip(rect, top, row.height, (item, row), draw))
        top += row.height
    strips.append(
        pen.strip(rect, top, rect.height - top, ("footer", hidden), lambda canvas: _footer(canvas, hidden))
    )
    return Patch.stack(strips)


def _header(canvas: Canvas, title: str, count: str) -> None:
    x = canvas.px(PADDING + 2)
    taken = canvas.text_width(count, theme.DETAIL) + canvas.px(GAP)
    title = canvas.fit(title, theme.TITLE, canvas.width - 2 * x - taken)
    canvas.text(x, canvas.px(17), title, theme.TITLE, theme.TEXT)
    canvas.text(canvas.width - x - taken + canvas.px(GAP), canvas.px(17), count, theme.DETAIL, theme.QUIET)


def _footer(canvas: Canvas, hidden: tuple[int, int]) -> None:
    x = canvas.px(PADDING + 2)
    notes = (f"{hidden[0]} above" if hidden[0] else "", f"+{hidden[1]} more" if hidden[1] else "")
    text = canvas.fit(" · ".join(note for note in notes if note), theme.DETAIL, canvas.width - 2 * x)
    canvas.text(x, canvas.height - canvas.px(PADDING), text, theme.DETAIL, theme.QUIET)


def _row(pen: Pen, canvas: Canvas, item: ChecklistItem, row: ListRow) -> None:
    px = canvas.px
    side = px(TILE)
    if item.current:
        area = Rect(px(3), 0, canvas.width - 2 * px(3), row.height)
        canvas.rounded(area, 5.0 * pen.unit, theme.ACCENT, 0.16)
        canvas.rounded(Rect(px(2), px(4), px(3), row.height - 2 * px(4)), 1.5 * pen.unit, theme.ACCENT, 1.0)
    x = px(PADDING + 2)
    if item.number is not None:
        label = str(item.number)
        right = x + px(NUMBER) - px(3)
        face = theme.LABEL if item.current else theme.DETAIL
        canvas.text(right - canvas.text_width(label, face), px(19), label, face, theme.QUIET)
        x += px(NUMBER)
    pen.tile(canvas, item.picture, x, px(3), side, 0.5 if item.done else 1.0)
    if item.target_picture is not None:
        small = px(TARGET)
        left = canvas.width - px(PADDING) - small
        pen.tile(canvas, item.target_picture, left, px(5), small, 0.4 if item.done else 1.0)
    _row_text(canvas, item, row, x + side + px(GAP))


def _row_text(canvas: Canvas, item: ChecklistItem, row: ListRow, x: int) -> None:
    px = canvas.px
    face = theme.ITEM_CURRENT if item.current else theme.ITEM
    if canvas.text_width(item.text, face) > row.text_width:
        face = theme.Face(theme.DETAIL.size, face.weight)
    line = canvas.fit(item.text, face, row.text_width)
    baseline = px(13) if row.detail else px(19)
    drawn = canvas.text(x, baseline, line, face, theme.DONE if item.done else theme.TEXT)
    if item.done and drawn > 0:
        y = baseline - px(4.5)
        canvas.shape([(x - px(1), y), (x + drawn + px(1), y)], theme.TEXT, line=max(1.0, 1.2 * px(1)))
    for i, detail in enumerate(row.detail):
        canvas.text(x, px(26 + LINE * i), detail, theme.DETAIL, theme.DONE if item.done else theme.QUIET)
