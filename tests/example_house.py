"""The house of docs/build-a-house.md, written from the page itself."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[1] / "docs" / "build-a-house.md"
FILES = dict(
    re.findall(
        r"^`([\w.]+)`: .*?^```(?:xml|toml)\n(.*?)^```", PAGE.read_text("utf-8"), re.DOTALL | re.MULTILINE
    )
)


def write_example_house(folder):
    """Write the page's files into a folder; returns the catalogue's path."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in FILES.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder / "catalogue.toml"
