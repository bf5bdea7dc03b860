"""docs/paper.md names tests that exist, and every test of this package."""

import re
from pathlib import Path

TESTS = Path(__file__).parents[1]
PAGE = (TESTS.parent / "docs" / "paper.md").read_text(encoding="utf-8")
LINKS = re.findall(r"`((?:paper/)?test_\w+\.py)::(test_\w+)`", PAGE)


def test_every_sentence_leads_to_a_test_that_exists():
    assert len(LINKS) > 50
    for file, name in LINKS:
        assert f"\ndef {name}(" in (TESTS / file).read_text(encoding="utf-8"), f"{file}::{name}"


def test_every_test_of_a_section_stands_beside_its_sentence():
    written = {
        (f"paper/{path.name}", name)
        for path in Path(__file__).parent.glob("test_section_*.py")
        for name in re.findall(r"^def (test_\w+)\(", path.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert written <= set(LINKS)
    assert all(line.count("|") == 3 for line in PAGE.splitlines() if "::test_" in line)
