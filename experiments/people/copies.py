"""Where copies of a study's data were written, so that somebody who is erased is erased there too."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

import msgspec

INDEX = "copies.jsonl"  # in the study's folder

Kind = Literal["backup", "export", "table"]


class Copy(msgspec.Struct, frozen=True):
    """A copy: what it is, where it was written, and when."""

    kind: Kind
    path: str
    made: str


def note_copy(folder: Path, kind: Kind, path: Path) -> None:
    """Remember a copy; call it before the copy is written."""
    made = datetime.now(UTC).isoformat(timespec="seconds")
    line = msgspec.json.encode(Copy(kind, str(path.absolute()), made)) + b"\n"
    with (folder / INDEX).open("ab") as file:
        file.write(line)


def copies(folder: Path) -> list[Copy]:
    """All copies that were made, each path once."""
    path = folder / INDEX
    lines = path.read_bytes().splitlines() if path.is_file() else []
    found = [msgspec.json.decode(line, type=Copy) for line in lines if line.endswith(b"}")]
    return list({copy.path: copy for copy in found}.values())
