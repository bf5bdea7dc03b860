"""Diagrams of the documentation are drawn as SVG while the site is built, or the build fails."""

import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from pymdownx.superfences import SuperFencesException

from tools.diagrams import fence

DOCS = Path(__file__).parents[2] / "docs"
SOURCES = [
    source
    for page in sorted(DOCS.glob("*.md"))
    for source in re.findall(r"```mermaid\n(.*?)```", page.read_text("utf-8"), re.DOTALL)
]


@pytest.mark.parametrize("source", SOURCES)
def test_every_message_of_a_diagram_is_an_arrow(source):
    drawing = ElementTree.fromstring(fence(source))
    arrows = [path for path in drawing.iter("path") if path.get("class") == "head"]
    assert len(arrows) == len(re.findall(r"\w+--?>>\w+:", source)) > 0
    shown = {element.text for element in drawing.iter("text")}
    assert set(re.findall(r"participant \w+ as (\w+)", source)) <= shown


@pytest.mark.parametrize(
    "line", ["A->>B: x", "A-)B: x", "Note left of A: x", "end", "loop every day", "participant A"]
)
def test_an_unknown_line_ends_the_build(line):
    with pytest.raises(SuperFencesException):
        fence(f"sequenceDiagram\nparticipant A as One\n{line}")


def test_another_kind_of_diagram_ends_the_build():
    with pytest.raises(SuperFencesException, match="only sequenceDiagram"):
        fence("flowchart TB\nA --> B")
