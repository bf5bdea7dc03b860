"""SHA-256 of every file of a run directory, in the format of `sha256sum`."""

import hashlib
import re
from collections.abc import Iterable
from pathlib import Path

from experiments.errors import RecordError
from mjsim.support.files import check_input, read_bytes, write_text_atomically

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


def sha256_of(path: Path) -> str:
    """SHA-256 of a file's content, in hexadecimal digits."""
    check_input(path)
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
