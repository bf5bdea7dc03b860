"""Drawing of the task list."""

from hud import theme
from hud.canvas import Canvas, Patch, Rect
from hud.layout import ListRow
from hud.state import ChecklistItem
from hud.stencils import Stencils
from hud.texts import HudTexts, filled


def count_text(items: tuple[ChecklistItem, ...], texts: HudTexts) -> str:
    """What is left of a list, or which step of a numbered one is next."""
    left = sum(not item.done for item in items)
    if any(item.number is not None for item in items):
        number = len(items) - left + 1
        return filled(texts.next_step, number=number, count=len(items)) if left else texts.done
    return filled(texts.left, count=left) if left else texts.none_left


def hidden_text(above: int, more: int, texts: HudTexts) -> str:
    """How many items of a list are hidden before and after those that are shown."""
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
    """The task list: a title, a count, the items that fit, and a note about hidden ones."""
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
