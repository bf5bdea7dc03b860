"""Keep a list of all copies of a study's data, so that participants can be erased from them."""

from collections.abc import Collection
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

import msgspec

from mjsim.support.files import write_text_atomically

INDEX = "copies.jsonl"

DATABASES = ("backup", "database")
Kind = Literal["backup", "database", "export", "table", "analysis", "film", "page", "metrics"]


class Copy(msgspec.Struct, frozen=True, omit_defaults=True):
    """A file or folder that was made from study data. `source` is a path within the study folder."""

    kind: Kind
    path: str
    made: str
    source: str = ""


def note_copy(folder: Path, kind: Kind, path: Path, source: str = "") -> None:
    """Add a copy to the list in a folder. Call this function before the copy is written."""
    made = datetime.now(UTC).isoformat(timespec="seconds")
    line = msgspec.json.encode(Copy(kind, str(path.absolute()), made, source)) + b"\n"
    with (folder / INDEX).open("ab") as file:
        file.write(line)


def note_derived(source: Path, kind: Kind, path: Path) -> None:
    """Record a file that was made from a run or a table in the nearest `copies.jsonl` above its source."""
    source = source.absolute()
    for folder in (source, *source.parents):
        if (folder / INDEX).is_file():
            return note_copy(folder, kind, path, str(source.relative_to(folder)))


def copies(folder: Path) -> list[Copy]:
    """Return all copies in the list of a folder. If a path is listed several times, the last entry counts."""
    path = folder / INDEX
    lines = path.read_bytes().splitlines() if path.is_file() else []
    found = [msgspec.json.decode(line, type=Copy) for line in lines if line.endswith(b"}")]
    return list({copy.path: copy for copy in found}.values())


def forget_copies(folder: Path, paths: Collection[str]) -> None:
    if not paths:
        return
    left = [copy for copy in copies(folder) if copy.path not in paths]
    write_text_atomically(folder / INDEX, "".join(msgspec.json.encode(copy).decode() + "\n" for copy in left))
