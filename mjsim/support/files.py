"""Read files with a size limit, write files atomically, and compute digests of source code.

Temporary files and folders are created next to their final path, and their names begin with `WORK`. Those of
a killed process are removed after a day, as soon as another process writes to the same folder.
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
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

MAX_INPUT = 256_000_000  # maximum size of input files, in bytes
# Timeouts for the next part of a stream and for the whole stream, in seconds.
MAX_SILENCE, MAX_WAIT = 8.0, 60.0
WORK = ".mjsim-work-"
MAX_AGE = 24 * 3600  # age after which leftover temporary files are removed, in seconds

_AT_FDCWD, _RENAME_EXCHANGE = -100, 2  # constants for Linux's renameat2 call
ROOT = Path(__file__).parents[2]  # folder that contains all packages
PACKAGES = ("experiments", "hud", "mjsim", "planner")


def check_input(path: Path) -> None:
    """Raise an OSError if a path is a pipe, a device, or a file that is larger than `MAX_INPUT`."""
    found = path.stat()
    if not (
        stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)
    ):  # opening a folder later raises a clearer error
        raise OSError(errno.EINVAL, "not a regular file", str(path))
    if found.st_size > MAX_INPUT:
        raise OSError(errno.EFBIG, f"larger than {MAX_INPUT // 10**6} MB", str(path))


def read_bytes(path: Path) -> bytes:
    """Read a binary file. Raise an OSError if it is missing, too large or not a regular file."""
    check_input(path)
    with path.open("rb") as file:
        return file.read(MAX_INPUT)


def read_stream(stream: int) -> bytes:
    """Read all data from a file descriptor. Raise an OSError on a timeout or if there is too much data."""
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
    """Read a UTF-8 text file. Raise an OSError or a UnicodeDecodeError if that fails."""
    return read_bytes(path).decode("utf-8-sig").replace("\r\n", "\n")


def read_json(text: str) -> Any:
    """Parse strict JSON. Raise a ValueError if it contains a repeated key, NaN or infinity."""
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
    """Replace a file atomically. Yield a temporary path, which is renamed to `path` on success.

    If an exception is raised, the temporary file is removed. It has the same suffix as `path`, because image
    and video encoders derive the format from the suffix. Symbolic links are followed. Other users may read the file
    unless they could not read the folder or the file that is replaced.
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
        temporary.chmod(0o600 if _is_private(path) or _is_private(path.parent) else 0o644)
        temporary.replace(path)
    except OSError as error:
        if error.errno is not None and error.filename is None:  # for example because the disk is full
            error.filename = str(path)
        raise
    finally:
        temporary.unlink(missing_ok=True)


def _is_private(path: Path) -> bool:
    return path.exists() and not path.stat().st_mode & (stat.S_IRWXG | stat.S_IRWXO)


@contextmanager
def work_folder(parent: Path) -> Iterator[Path]:
    """Yield a new temporary folder inside `parent`, which is removed afterwards unless it has been moved."""
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


def write_folder(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write a new folder atomically. If another process has written it in the meantime, keep that version."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    with work_folder(folder.parent) as work:
        for name, content in files.items():
            (work / name).parent.mkdir(exist_ok=True)
            (work / name).write_bytes(content)
        work.chmod(0o755)
        try:
            work.rename(folder)
        except OSError:
            if not all((folder / name).is_file() for name in files):
                raise


@functools.lru_cache(maxsize=64)  # each process scans a folder once a day
def _tidy(folder: Path, _day: int) -> None:
    remove_leftovers(folder)


def _today() -> int:
    return int(time.time() // MAX_AGE)


def remove_leftovers(folder: Path, max_age: float = MAX_AGE, prefix: str = WORK) -> None:
    """Remove files and folders whose names begin with `prefix` if they have not changed for `max_age` seconds."""
    with os.scandir(folder) as entries:
        paths = [Path(entry) for entry in entries if entry.name.startswith(prefix)]
    for path in paths:
        with contextlib.suppress(OSError):  # another process may remove the path first
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
    """Swap two files or folders on one file system. The swap is atomic if the file system supports it."""
    libc, names = ctypes.CDLL(None, use_errno=True), (os.fsencode(one), os.fsencode(other))
    if libc.renameat2(_AT_FDCWD, names[0], _AT_FDCWD, names[1], _RENAME_EXCHANGE) == 0:
        return
    error = ctypes.get_errno()
    if error not in (errno.EINVAL, errno.ENOSYS):  # these two mean that swapping is not supported
        raise OSError(error, os.strerror(error), str(one), None, str(other))
    with work_folder(one.parent) as aside:
        other.rename(aside / "other")
        one.rename(other)
        (aside / "other").rename(one)


def is_file(path: Path) -> bool:
    """Return True if a path is an existing file. Invalid paths give False instead of an error."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


@functools.cache
def source_digest(*places: str) -> str:
    """Return a digest of the Python files at the given paths below `ROOT`, or in all packages by default."""
    return digest_of(*(ROOT / place for place in places or PACKAGES))


def digest_of(*places: Path) -> str:
    """Return a digest of the paths and contents of files, as 16 hexadecimal digits."""
    digest = hashlib.sha256()
    for place in places:
        for path in [place] if place.is_file() else sorted(place.rglob("*.py")):
            digest.update(path.relative_to(place.parent).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:16]
