"""SHA-256 of every file of a run directory, in the format of `sha256sum`."""

import hashlib
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from experiments.errors import RecordError
from mjsim.files import check_input, read_bytes, write_text_atomically

CHECKSUMS = "SHA256SUMS"
_LINE = re.compile(r"([0-9a-f]{64})  ([^/\\]+)")


def write_checksums(folder: Path, names: Iterable[str]) -> None:
    """Write `SHA256SUMS` for those of the files that exist; `sha256sum -c SHA256SUMS` checks it."""
    found = sorted(name for name in names if (folder / name).is_file())
    write_text_atomically(
        folder / CHECKSUMS, "".join(f"{sha256_of(folder / name)}  {name}\n" for name in found)
    )


def read_checksums(folder: Path) -> dict[str, str]:
    """SHA-256 by file name, as written with the run.

    Raises:
        RecordError: The file is missing or damaged; the message names it.
    """
    path = folder / CHECKSUMS
    try:
        lines = read_bytes(path).decode("ascii").split("\n")
    except (OSError, UnicodeDecodeError) as error:
        raise RecordError(f"cannot read {path}: {error}") from error
    found = [_LINE.fullmatch(line) for line in lines[:-1]]
    sums = {match[2]: match[1] for match in found if match}
    if lines[-1] or len(sums) != len(found):
        raise RecordError(f"{path} is not as written: a line is not a checksum and a file name")
    return sums


def checksum_faults(folder: Path, names: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield each file that is not as written, of those in `SHA256SUMS` and of `names`, with a message.

    Raises:
        RecordError: `SHA256SUMS` is missing or damaged.
    """
    sums = read_checksums(folder)
    for name in sorted({*sums, *(name for name in names if (folder / name).is_file())}):
        if name not in sums:
            yield name, f"{name} was not written with the run: {CHECKSUMS} does not name it"
        elif not (folder / name).is_file():
            yield name, f"{name} is missing; it was written with the run"
        elif sha256_of(folder / name) != sums[name]:
            yield name, f"{name} is not the file that was written: its SHA-256 is another"


def sha256_of(path: Path) -> str:
    """SHA-256 of a file's content, in hexadecimal digits."""
    check_input(path)
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
