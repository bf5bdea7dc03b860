"""Create self-contained HTML pages with text, tables and figures from the template `page.html.j2`."""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import jinja2
from markupsafe import Markup

from experiments.analysis.statistics.effects import FTest
from experiments.analysis.statistics.mixed import WaldTest


class Paragraph(NamedTuple):
    """A paragraph of plain text with a CSS class."""

    text: str
    kind: str = ""


class TableBlock(NamedTuple):
    """A table whose numbers are shown with three significant digits."""

    columns: Sequence[str]
    rows: Sequence[Sequence[object]]


class FigureBlock(NamedTuple):
    """A figure with a caption. Its number is assigned by the page."""

    drawing: Markup
    caption: str


Block = Paragraph | TableBlock | FigureBlock


def page(title: str, origin: str, sections: Iterable[tuple[str, Iterable[Block]]]) -> str:
    """Return an HTML page with a title and sections. Empty tables and empty sections are omitted.

    `origin` states whether the participants were simulated. It is shown in the title and below every heading.
    """
    shown_blocks = (
        (heading, [block for block in blocks if not isinstance(block, TableBlock) or block.rows])
        for heading, blocks in sections
    )
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("experiments.analysis", "."), autoescape=True, trim_blocks=True
    )
    environment.filters["shown"] = shown
    environment.tests["paragraph"] = lambda block: isinstance(block, Paragraph)
    environment.tests["table"] = lambda block: isinstance(block, TableBlock)
    environment.tests["plain_number"] = lambda v: isinstance(v, int | float) and not isinstance(v, bool)
    template = environment.get_template("page.html.j2")
    return template.render(title=title, origin=origin, sections=[s for s in shown_blocks if s[1]])


def table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> TableBlock:
    return TableBlock(columns, list(rows))


def shown(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, tuple):
        return f"[{', '.join(shown(v) for v in value)}]"
    if isinstance(value, float):
        return f"{value:.0f}" if 1e3 <= abs(value) < math.inf else f"{value:.3g}"
    return str(value)


def p_value(p: float | None) -> str:
    """Format a p-value with three decimals. Values below .001 are shown as '< .001'."""
    return "-" if p is None else "< .001" if p < 0.001 else f"{p:.3f}".lstrip("0")


def p_text(p: float) -> str:
    """Format a p-value as `p = .466` or `p < .001`."""
    text = p_value(p)
    return f"p {text}" if text.startswith("<") else f"p = {text}"


def freedom(test: FTest | WaldTest) -> str:
    return f"{test.df1}, {test.df2:.4g}"
