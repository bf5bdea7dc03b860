"""Reading files to an end and values strictly; writing files and folders atomically; digests of source code.

Work in progress has a name that begins with `WORK`, in the folder of its final place. The work of killed processes is
removed, once it is a day old, by the next process that writes into the same folder.
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

MAX_INPUT = 256_000_000  # bytes of a file that is read
MAX_SILENCE, MAX_WAIT = 8.0, 60.0  # s to wait for the next part of a stream, and for all of it
WORK = ".mjsim-work-"
MAX_AGE = 24 * 3600  # s since the last change of a leftover, after which it is removed

_AT_FDCWD, _RENAME_EXCHANGE = -100, 2  # of Linux's renameat2
ROOT = Path(__file__).parents[2]  # folder of the packages
PACKAGES = ("experiments", "hud", "mjsim", "planner")


def check_input(path: Path) -> None:
    """Raise an OSError where reading would not end (a pipe, a device), or has over `MAX_INPUT` bytes to read."""
    found = path.stat()
    if not (stat.S_ISREG(found.st_mode) or stat.S_ISDIR(found.st_mode)):  # opening says it of a folder
        raise OSError(errno.EINVAL, "not a regular file", str(path))
    if found.st_size > MAX_INPUT:
        raise OSError(errno.EFBIG, f"larger than {MAX_INPUT // 10**6} MB", str(path))


def read_bytes(path: Path) -> bytes:
    """The content of a file; an OSError as of `check_input`."""
    check_input(path)
    with path.open("rb") as file:
        return file.read(MAX_INPUT)


def read_stream(stream: int) -> bytes:
    """What a pipe or another stream holds, to its end; an OSError where it has too much or stops sending."""
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
    """The content of a UTF-8 file, with or without a byte order mark; an OSError as of `check_input`."""
    return read_bytes(path).decode("utf-8-sig").replace("\r\n", "\n")


def read_json(text: str) -> Any:
    """Values of strict JSON; a ValueError where a key is there twice, or a number is NaN or infinite."""
    return json.loads(text, object_pairs_hook=_once, parse_constant=_refuse)


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"the key {next(k for k in keys if keys.count(k) > 1)!r} is there twice; keep one")
    return found


def _refuse(constant: str) -> None:
    raise ValueError(f"{constant} is no number of JSON")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the folder of `path`; rename it over `path` on success, else remove it.

    The temporary name keeps the suffix, because encoders choose the container by it. A symbolic link is followed.
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
        if error.errno is not None and error.filename is None:  # of a write: a full disk
            error.filename = str(path)
        raise
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def work_folder(parent: Path) -> Iterator[Path]:
    """Yield a new folder in the existing folder `parent`; it is removed afterwards unless it was moved."""
    _tidy(parent, _today())
    folder = Path(tempfile.mkdtemp(dir=parent, prefix=f"{WORK}{os.getpid()}-"))
    try:
        yield folder
    except OSError as error:
        if error.errno is not None and error.filename is None:  # of a write: a full disk
            error.filename = str(parent)
        raise
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@functools.lru_cache(maxsize=64)
def _tidy(folder: Path, _day: int) -> None:
    """Remove the leftovers in a folder; once a day per process, as a batch writes many trials into one folder."""
    remove_leftovers(folder)


def _today() -> int:
    return int(time.time() // MAX_AGE)


def remove_leftovers(folder: Path, max_age: float = MAX_AGE, prefix: str = WORK) -> None:
    """Remove from `folder` the work of killed processes: all that has not changed for `max_age` seconds."""
    with os.scandir(folder) as entries:
        paths = [Path(entry) for entry in entries if entry.name.startswith(prefix)]
    for path in paths:
        with contextlib.suppress(OSError):  # removed by another process
            changed = max(part.lstat().st_mtime for part in (path, *path.rglob("*")))
            if time.time() - changed < max_age:
                continue
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path)
            else:
                path.unlink()


def write_text_atomically(path: Path, text: str) -> None:
    """Write UTF-8 `text` to `path`, whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def exchange(one: Path, other: Path) -> None:
    """Swap two paths of one file system; both exist at every moment, on file systems that support it."""
    libc, names = ctypes.CDLL(None, use_errno=True), (os.fsencode(one), os.fsencode(other))
    if libc.renameat2(_AT_FDCWD, names[0], _AT_FDCWD, names[1], _RENAME_EXCHANGE) == 0:
        return
    error = ctypes.get_errno()
    if error not in (errno.EINVAL, errno.ENOSYS):  # the answers of file systems without exchange
        raise OSError(error, os.strerror(error), str(one), None, str(other))
    with work_folder(one.parent) as aside:
        other.rename(aside / "other")
        one.rename(other)
        (aside / "other").rename(one)


def is_file(path: Path) -> bool:
    """Whether there is such a file; False for names that no file can have (too long, a null character)."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


@functools.cache
def source_digest(*places: str) -> str:
    """16 hex digits over Python sources, given by modules and folders in that of the packages; all if none is given."""
    return digest_of(*(ROOT / place for place in places or PACKAGES))


def digest_of(*places: Path) -> str:
    """16 hex digits over Python files and the names under which they lie in `places`, which are files or folders."""
    digest = hashlib.sha256()
    for place in places:
        for path in [place] if place.is_file() else sorted(place.rglob("*.py")):
            digest.update(path.relative_to(place.parent).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()[:16]
