"""Draw sequence diagrams from Markdown as SVG while the site is built, so that its pages need no script.

Diagrams are code fences named `mermaid`. They use a subset of Mermaid's notation, so other websites such as
GitHub can draw the same diagrams with Mermaid itself.
"""

import html
import re
import textwrap
from collections.abc import Iterator
from typing import Any

from pymdownx.superfences import SuperFencesException

COLUMN, ROW, MARGIN = 150, 30, 16  # sizes in pixels
_PARTICIPANT = re.compile(r"participant (\w+) as (\w+)")
_ARROW = re.compile(r"(\w+)(--?>>)(\w+): (.+)")
_NOTE = re.compile(r"Note over (\w+): (.+)")
_BLOCK = re.compile(r"(alt|loop|else) (.+)")
_STYLE = (
    ".diagram{max-width:100%;height:auto}.diagram text{font:13px sans-serif;fill:currentColor;text-anchor:middle}"
    ".diagram line,.diagram rect,.diagram path{stroke:currentColor;fill:none}"
    ".diagram .life{stroke-dasharray:2 4;opacity:.5}"
    ".diagram .reply{stroke-dasharray:5 4}.diagram .block{opacity:.4}.diagram .head{fill:currentColor;stroke:none}"
    ".diagram text.left{text-anchor:start;font-style:italic}.diagram text.note{font-style:italic}"
)


def fence(source: str, *_: Any, **__: Any) -> str:
    """Draw the diagram in a code fence.

    Raises:
        SuperFencesException: A line is not in the supported notation. Other exceptions would print the source
            instead.
    """
    try:
        return f'<div class="diagram">{Sequence(source).svg()}</div>'
    except ValueError as error:
        raise SuperFencesException(str(error)) from error


class Sequence:
    """A sequence diagram with participants in columns and messages in rows."""

    def __init__(self, source: str) -> None:
        """Parse a diagram.

        Raises:
            ValueError: A line is not in the supported notation.
        """
        first, *self._lines = [line.strip() for line in source.strip().splitlines() if line.strip()]
        if first != "sequenceDiagram":
            raise ValueError(f"cannot draw diagram '{first}': only sequenceDiagram is supported")
        found = [_PARTICIPANT.fullmatch(line) for line in self._lines]
        self._names = {match[1]: match[2] for match in found if match}
        self._column = {key: MARGIN + COLUMN * (0.5 + n) for n, key in enumerate(self._names)}
        self._y = MARGIN + 46.0
        self._open: list[float] = []

    def svg(self) -> str:
        """Return the drawing as inline SVG."""
        width = 2 * MARGIN + COLUMN * len(self._names)
        body = [part for line in self._lines if not _PARTICIPANT.fullmatch(line) for part in self._row(line)]
        if self._open:
            raise ValueError("a block of the diagram has no end")
        heads = [part for key, x in self._column.items() for part in self._head(self._names[key], x)]
        label = html.escape("Messages between " + ", ".join(self._names.values()))
        return (
            f'<svg viewBox="0 0 {width} {self._y + MARGIN:g}" width="{width}" role="img" aria-label="{label}">'
            f"<style>{_STYLE}</style>{''.join(heads + body)}</svg>"
        )

    def _head(self, name: str, x: float) -> Iterator[str]:
        yield f'<rect x="{x - 65:g}" y="{MARGIN}" width="130" height="28" rx="4"/>'
        yield _text(x, MARGIN + 19, name)
        yield f'<line class="life" x1="{x:g}" x2="{x:g}" y1="{MARGIN + 28}" y2="{self._y:g}"/>'

    def _row(self, line: str) -> Iterator[str]:
        if found := _ARROW.fullmatch(line):
            yield from self._arrow(*found.groups())
        elif found := _NOTE.fullmatch(line):
            for part in textwrap.wrap(found[2], 32):
                yield _text(self._column[found[1]], self._y + 12, part, "note")
                self._y += 18
            self._y += 8
        elif found := _BLOCK.fullmatch(line):
            if found[1] != "else":
                self._open.append(self._y)
            yield _text(MARGIN + 8, self._y + 17, f"{found[1]}: {found[2]}", "left")
            if found[1] == "else":
                yield f'<line class="block" x1="{MARGIN}" x2="{self._right}" y1="{self._y:g}" y2="{self._y:g}"/>'
            self._y += ROW
        elif line == "end" and self._open:
            top = self._open.pop()
            height = self._y - top
            yield f'<rect class="block" x="{MARGIN}" y="{top:g}" width="{self._right - MARGIN:g}" height="{height:g}"/>'
            self._y += 10
        else:
            raise ValueError(f"cannot draw line '{line}' of a sequence diagram")

    @property
    def _right(self) -> float:
        return MARGIN + COLUMN * len(self._names)

    def _arrow(self, sender: str, kind: str, receiver: str, text: str) -> Iterator[str]:
        if not {sender, receiver} <= self._column.keys():
            raise ValueError(
                f"a message leads from {sender} to {receiver}, and one of them is not a participant"
            )
        x, end = self._column[sender], self._column[receiver]
        step = 7 if end > x else -7
        self._y += ROW
        y, style = self._y, ' class="reply"' if kind == "-->>" else ""
        yield _text((x + end) / 2, y - 5, text)
        yield f'<line{style} x1="{x:g}" x2="{end:g}" y1="{y:g}" y2="{y:g}"/>'
        yield f'<path class="head" d="M{end:g},{y:g}l{-step},-4v8z"/>'
        self._y += 6


def _text(x: float, y: float, text: str, kind: str = "") -> str:
    style = f' class="{kind}"' if kind else ""
    return f'<text{style} x="{x:g}" y="{y:g}">{html.escape(text)}</text>'
