"""HTML pages of one file (`page.html.j2`): text, tables and inline figures, no scripts, no external content."""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import jinja2
from markupsafe import Markup

from experiments.analysis.statistics.effects import FTest
from experiments.analysis.statistics.mixed import WaldTest


class Paragraph(NamedTuple):
    """Plain text; `kind` is its class in HTML."""

    text: str
    kind: str = ""


class Table(NamedTuple):
    """A table; numbers are rounded to three digits."""

    columns: Sequence[str]
    rows: Sequence[Sequence[object]]


class Picture(NamedTuple):
    """A figure, and its caption; figures are numbered."""

    drawing: Markup
    caption: str


Block = Paragraph | Table | Picture


def page(title: str, origin: str, sections: Iterable[tuple[str, Iterable[Block]]]) -> str:
    """A whole page; tables without rows and sections without content are left out.

    `origin` says whether people were simulated; it appears in the title and under every heading.
    """
    shown_blocks = (
        (heading, [block for block in blocks if not isinstance(block, Table) or block.rows])
        for heading, blocks in sections
    )
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("experiments.analysis", "."), autoescape=True, trim_blocks=True
    )
    environment.filters["shown"] = shown
    environment.tests["paragraph"] = lambda block: isinstance(block, Paragraph)
    environment.tests["table"] = lambda block: isinstance(block, Table)
    environment.tests["plain_number"] = lambda v: isinstance(v, int | float) and not isinstance(v, bool)
    template = environment.get_template("page.html.j2")
    return template.render(title=title, origin=origin, sections=[s for s in shown_blocks if s[1]])


def table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> Table:
    """A table of rows that are made one by one."""
    return Table(columns, list(rows))


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


def freedom(test: FTest | WaldTest) -> str:
    """Degrees of freedom of an F test."""
    return f"{test.df1}, {test.df2:.4g}"
