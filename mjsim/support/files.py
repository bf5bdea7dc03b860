"""Size-limited reading, atomic writing, and digests of source code.

Temporary files and folders are created next to their final path, with names that begin with `WORK`. Leftovers of
killed processes are removed after a day, when another process writes into the same folder.
"""

import contextlib
import ctypes
import errno
import functools
import hashlib
import json
import os
import select
import shutil
import stat
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

MAX_INPUT = 256_000_000  # size limit of input files, in bytes
# Timeouts for the next part of a stream and for the whole stream, in seconds
MAX_SILENCE, MAX_WAIT = 8.0, 60.0
WORK = ".mjsim-work-"
MAX_AGE = 24 * 3600  # age at which temporary files of killed processes are removed, in seconds

_AT_FDCWD, _RENAME_EXCHANGE = -100, 2  # constants of Linux's renameat2
ROOT = Path(__file__).parents[2]  # folder that contains the packages
PACKAGES = ("experiments", "hud", "mjsim", "planner")


def check_input(path: Path) -> None:
    """Raise an OSError if a path is a pipe or device, or a file larger than `MAX_INPUT`."""
    found = path.stat()
    if not (
        stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)
    ):  # opening a folder raises its own error
        raise OSError(errno.EINVAL, "not a regular file", str(path))
    if found.st_size > MAX_INPUT:
        raise OSError(errno.EFBIG, f"larger than {MAX_INPUT // 10**6} MB", str(path))


def read_bytes(path: Path) -> bytes:
    """Read a file. Raise an OSError if it is missing, too large, or not a regular file."""
    check_input(path)
    with path.open("rb") as file:
        return file.read(MAX_INPUT)


def read_stream(stream: int) -> bytes:
    """Read a file descriptor, such as a pipe, to its end. Raise an OSError if it is too large or times out."""
    text, ends = bytearray(), time.monotonic() + MAX_WAIT
    while True:
        silence = min(MAX_SILENCE, ends - time.monotonic())
        if not os.isatty(stream) and not select.select([stream], [], [], max(0.0, silence))[0]:
            raise OSError(errno.ETIMEDOUT, "sends nothing more, and does not end")
        if not (part := os.read(stream, 1 << 20)):
            return bytes(text)
        text += part
        if len(text) > MAX_INPUT:
            raise OSError(errno.EFBIG, f"larger than {MAX_INPUT // 10**6} MB")


def read_text(path: Path) -> str:
    """Read a UTF-8 file, with or without a byte order mark. Raise an OSError if that fails."""
    return read_bytes(path).decode("utf-8-sig").replace("\r\n", "\n")


def read_json(text: str) -> Any:
    """Parse strict JSON. Raise a ValueError for a repeated key, NaN or infinity."""
    return json.loads(text, object_pairs_hook=_unique_keys, parse_constant=_reject_constant)


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"the key {next(k for k in keys if keys.count(k) > 1)!r} is there twice; keep one")
    return found


def _reject_constant(constant: str) -> None:
    raise ValueError(f"{constant} is not a JSON number")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path next to `path`. Rename it to `path` on success, otherwise remove it.

    The temporary path has the same suffix, because image and video encoders derive the format from it. Symbolic links
    are followed.
    """
    path = Path(os.path.realpath(path))
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, "not a regular file", str(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    _tidy(path.parent, _today())
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f"{WORK}{os.getpid()}-", suffix=path.suffix)
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(path)
    except OSError as error:
        if error.errno is not None and error.filename is None:  # for example because the disk is full
            error.filename = str(path)
        raise
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def work_folder(parent: Path) -> Iterator[Path]:
    """Yield a new folder inside `parent`. Remove it afterwards unless it was moved."""
    _tidy(parent, _today())
    folder = Path(tempfile.mkdtemp(dir=parent, prefix=f"{WORK}{os.getpid()}-"))
    try:
        yield folder
    except OSError as error:
        if error.errno is not None and error.filename is None:  # for example because the disk is full
            error.filename = str(parent)
        raise
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@functools.lru_cache(maxsize=64)  # each process scans a folder only once a day
def _tidy(folder: Path, _day: int) -> None:
    remove_leftovers(folder)


def _today() -> int:
    return int(time.time() // MAX_AGE)


def remove_leftovers(folder: Path, max_age: float = MAX_AGE, prefix: str = WORK) -> None:
    """Remove temporary files and folders that have not changed for `max_age` seconds."""
    with os.scandir(folder) as entries:
        paths = [Path(entry) for entry in entries if entry.name.startswith(prefix)]
    for path in paths:
        with contextlib.suppress(OSError):  # another process may remove it first
            changed = max(part.lstat().st_mtime for part in (path, *path.rglob("*")))
            if time.time() - changed < max_age:
                continue
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                path.unlink()


def write_text_atomically(path: Path, text: str) -> None:
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def exchange(one: Path, other: Path) -> None:
    """Swap two paths on the same file system, atomically if the file system supports it."""
    libc, names = ctypes.CDLL(None, use_errno=True), (os.fsencode(one), os.fsencode(other))
    if libc.renameat2(_AT_FDCWD, names[0], _AT_FDCWD, names[1], _RENAME_EXCHANGE) == 0:
        return
    error = ctypes.get_errno()
    if error not in (errno.EINVAL, errno.ENOSYS):  # the file system cannot exchange
        raise OSError(error, os.strerror(error), str(one), None, str(other))
    with work_folder(one.parent) as aside:
        other.rename(aside / "other")
        one.rename(other)
        (aside / "other").rename(one)


def is_file(path: Path) -> bool:
    """Return True if a path is an existing file. Invalid paths, such as those with a null character, give False."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


@functools.cache
def source_digest(*places: str) -> str:
    """Return a digest of Python modules and folders, given relative to `ROOT`. By default, of all packages."""
    return digest_of(*(ROOT / place for place in places or PACKAGES))


def digest_of(*places: Path) -> str:
    """Return 16 hexadecimal digits that identify the relative paths and contents of Python files."""
    digest = hashlib.sha256()
    for place in places:
        for path in [place] if place.is_file() else sorted(place.rglob("*.py")):
            digest.update(path.relative_to(place.parent).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:16]
