"""The house of docs/bring-your-house.md, written from the page itself."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "bring-your-house.md"
_FILE = re.compile(r"^`([\w.]+)`: .*?^```(?:xml|toml)\n(.*?)^```", re.DOTALL | re.MULTILINE)


def write_example_house(folder: Path) -> Path:
    """Write the page's files into a folder; returns the catalogue's path."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in _FILE.findall(PAGE.read_text(encoding="utf-8")):
        (folder / name).write_text(text, encoding="utf-8")
    return folder / "catalogue.toml"
