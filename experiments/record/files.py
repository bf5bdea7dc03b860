"""Read and atomically write files with arrays, JSON and checksums."""

import csv
import hashlib
import io
import json
import re
import zipfile
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.errors import RecordError
from mjsim.support.files import (
    check_input,
    exchange,
    read_bytes,
    read_text,
    replacing,
    work_folder,
    write_text_atomically,
)
from mjsim.support.files import read_json as strict_json

# The data type (a NumPy name or `TEXT`) and the shape of an array. A dimension of None allows any length.
Layout = tuple[str, tuple[int | None, ...]]
TEXT = "U"
_LEVEL = 3


def csv_text(columns: Sequence[str], rows: Iterable[Iterable[object]]) -> str:
    """Format a table as CSV."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([columns, *rows])
    return text.getvalue()


def read_arrays(
    path: Path, layouts: Mapping[str, Layout] | None = None, *, only: Collection[str] | None = None
) -> dict[str, NDArray[Any]]:
    """Read arrays from an NPZ file, and return them by name.

    Args:
        path: The file.
        layouts: Data type and shape of each required array, or None to skip the check.
        only: Names of the arrays to read, or None for all.

    Raises:
        RecordError: The file is missing, damaged or incomplete.
    """
    try:
        with np.load(io.BytesIO(read_bytes(path)), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in only or archive.files}
    except FileNotFoundError as error:
        raise RecordError(f"cannot read {path}: {error.strerror}") from error
    except Exception as error:  # zipfile and NumPy raise many different exceptions for damaged files
        raise RecordError(f"{path} is truncated or damaged: {error}") from error
    bad = sorted(
        n for n, layout in (layouts or {}).items() if n not in arrays or not _fits(arrays[n], layout)
    )
    if bad:
        raise RecordError(f"{path} lacks {', '.join(bad)}, or has them in another type or shape")
    return arrays


def _fits(array: NDArray[Any], layout: Layout) -> bool:
    kind, shape = layout
    same_type = array.dtype.kind == kind if kind == TEXT else array.dtype == np.dtype(kind)
    return (
        same_type
        and len(shape) == array.ndim
        and all(wanted in (None, found) for wanted, found in zip(shape, array.shape, strict=True))
    )


def save_arrays(path: Path, arrays: Mapping[str, NDArray[Any]], *, small: bool = False) -> None:
    """Atomically write arrays to a compressed NPZ file.

    This is twice as fast as `np.savez_compressed`, but the files are a tenth larger. If `small` is true, LZMA
    makes the files a quarter smaller, but writing takes ten times as long.
    """
    method = zipfile.ZIP_LZMA if small else zipfile.ZIP_DEFLATED
    with (
        replacing(path) as temporary,
        zipfile.ZipFile(temporary, "w", method, compresslevel=_LEVEL) as archive,
    ):
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, np.asanyarray(array), allow_pickle=False)


def write_json(path: Path, value: Any) -> None:
    """Atomically write a value to a file as indented JSON."""
    write_text_atomically(path, json.dumps(value, indent=2) + "\n")


def read_json(path: Path) -> Any:
    """Read a JSON file. Raises `RecordError` if the file is missing or is not valid JSON."""
    try:
        return strict_json(read_text(path))
    except OSError as error:
        raise RecordError(f"cannot read {path}: {error.strerror}") from error
    except (ValueError, RecursionError) as error:  # not JSON, not UTF-8, or nested too deeply
        raise RecordError(f"{path} is not JSON: {error}") from error


@contextmanager
def replacing_folder(folder: Path, mode: int = 0o755) -> Iterator[Path]:
    """Replace a folder atomically. Yield a temporary folder, which becomes `folder` on success."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    with work_folder(folder.parent) as work:
        yield work
        work.chmod(mode)
        if folder.exists():
            exchange(work, folder)
        else:
            work.rename(folder)


CHECKSUMS = "SHA256SUMS"
_LINE = re.compile(r"([0-9a-f]{64})  ([^/\\]+)")


def write_checksums(folder: Path, names: Iterable[str]) -> None:
    """Write the checksums of all existing files in `names` to `SHA256SUMS`, in the `sha256sum` format."""
    found = sorted(name for name in names if (folder / name).is_file())
    write_text_atomically(
        folder / CHECKSUMS, "".join(f"{sha256_of(folder / name)}  {name}\n" for name in found)
    )


def read_checksums(folder: Path) -> dict[str, str]:
    """Read the hash of each file from `SHA256SUMS`. Raises `RecordError` if it is missing or damaged."""
    path = folder / CHECKSUMS
    try:
        lines = read_bytes(path).decode("ascii").split("\n")
    except (OSError, UnicodeDecodeError) as error:
        raise RecordError(f"cannot read {path}: {error}") from error
    found = [_LINE.fullmatch(line) for line in lines[:-1]]
    sums = {match[2]: match[1] for match in found if match}
    if lines[-1] or len(sums) != len(found):
        raise RecordError(f"{path} is damaged: a line is not a checksum and a file name")
    return sums


def sha256_of(path: Path) -> str:
    check_input(path)
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
