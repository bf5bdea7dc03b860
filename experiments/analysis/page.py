"""HTML pages of one file: text, tables and figures inside it, no scripts, nothing from elsewhere."""

import math
from collections.abc import Iterable, Sequence
from html import escape

STYLE = """\
body { font: 15px/1.45 system-ui, sans-serif; max-width: 74rem; margin: 2rem auto; padding: 0 1rem; color: #1b1b1b }
table { border-collapse: collapse; margin: .6rem 0 1.2rem; font-size: 13px }
th, td { border-bottom: 1px solid #ddd; padding: .2rem .7rem .2rem 0; text-align: left; vertical-align: top }
td.number { text-align: right; font-variant-numeric: tabular-nums }
svg { max-width: 100%; height: auto }
.origin { color: #b00020; font-weight: bold }
.missing { color: #666 }"""


def page(title: str, origin: str, parts: Iterable[str]) -> str:
    """A whole page.

    Args:
        title: Its title, plain text.
        origin: Whether people were simulated; it stands in the title and under every heading.
        parts: HTML of its sections.
    """
    head = f'<meta charset="utf-8"><title>{escape(origin)}: {escape(title)}</title><style>{STYLE}</style>'
    heading = f"<h1>{escape(title)}</h1>{origin_line(origin)}"
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head><body>{heading}\n{"".join(parts)}</body></html>\n'


def origin_line(origin: str) -> str:
    """A line that says whether people were simulated."""
    return f'<p class="origin">{escape(origin)}</p>\n'


def section(title: str, origin: str, *parts: str) -> str:
    """A heading, the origin of the data, and what follows; nothing where nothing follows."""
    inside = "".join(parts)
    return f"<section><h2>{escape(title)}</h2>{origin_line(origin)}{inside}</section>\n" if inside else ""


def paragraph(text: str, kind: str = "") -> str:
    """A paragraph of plain text."""
    attribute = f' class="{kind}"' if kind else ""
    return f"<p{attribute}>{escape(text)}</p>\n"


def table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; numbers are rounded to three digits. Nothing where there are no rows."""
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>\n" for row in rows)
    head = "".join(f"<th>{escape(name)}</th>" for name in columns)
    return f"<table><thead><tr>{head}</tr></thead><tbody>\n{body}</tbody></table>\n" if body else ""


def _cell(value: object) -> str:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    attribute = ' class="number"' if number else ""
    return f"<td{attribute}>{escape(shown(value))}</td>"


def shown(value: object) -> str:
    """A value as text: numbers with three digits, intervals in brackets, a dash for nothing."""
    if value is None:
        return "-"
    if isinstance(value, tuple):
        return f"[{', '.join(shown(v) for v in value)}]"
    if isinstance(value, float):
        return f"{value:.0f}" if 1e3 <= abs(value) < math.inf else f"{value:.3g}"
    return str(value)


def p_value(p: float | None) -> str:
    """A p value as it is printed: three decimals, or below .001."""
    return "-" if p is None else "< .001" if p < 0.001 else f"{p:.3f}".lstrip("0")
