"""Writing files and folders: complete, or not at all, and without traces of processes that were killed.

Work in progress lies beside its final place under a name that begins with `WORK`. Its writer holds a lock on it, which
the system releases when the process ends, however it ends. So whatever is not locked has been abandoned; the next
process that writes into the same folder removes it.
"""

import contextlib
import ctypes
import errno
import fcntl
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

WORK = ".mjsim-work-"

_AT_FDCWD, _RENAME_EXCHANGE = -100, 2  # of Linux's renameat2


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the folder of `path`; rename it over `path` on success, else remove it.

    The temporary name keeps the suffix, because encoders choose the container by it. A symbolic link is followed.

    Raises:
        OSError: The file cannot be written, or `path` is a folder, a device or a pipe.
    """
    path = Path(os.path.realpath(path))
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, "not a regular file", str(path))
    path.parent.mkdir(parents=True, exist_ok=True)
    remove_leftovers(path.parent)

    def make() -> Path:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=WORK, suffix=path.suffix)
        os.close(handle)
        return Path(name)

    with _locked(make) as temporary:
        try:
            yield temporary
            temporary.chmod(0o644)
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)


@contextmanager
def work_folder(parent: Path) -> Iterator[Path]:
    """Yield a new folder in the existing folder `parent`; it is removed afterwards unless it was moved.

    Raises:
        OSError: The folder cannot be made.
    """
    remove_leftovers(parent)
    with _locked(lambda: Path(tempfile.mkdtemp(dir=parent, prefix=WORK))) as folder:
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)


def remove_leftovers(folder: Path) -> None:
    """Remove from `folder` what killed processes were writing there."""
    with os.scandir(folder) as entries:
        names = [entry.name for entry in entries if entry.name.startswith(WORK)]
    for name in names:
        with contextlib.suppress(OSError):  # gone already, or still being written
            _remove_abandoned(folder / name)


def write_text_atomically(path: Path, text: str) -> None:
    """Write UTF-8 `text` to `path`, whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def exchange(one: Path, other: Path) -> None:
    """Swap two paths of one file system; at every moment there is something at both, where the system can do that.

    Raises:
        OSError: One of them does not exist or cannot be renamed.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    names = os.fsencode(one), os.fsencode(other)
    if libc.renameat2(_AT_FDCWD, names[0], _AT_FDCWD, names[1], _RENAME_EXCHANGE) == 0:
        return
    if ctypes.get_errno() not in (
        errno.EINVAL,
        errno.ENOSYS,
    ):  # what file systems answer that cannot exchange
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()), str(one), None, str(other))
    with work_folder(one.parent) as aside:
        other.rename(aside / "other")
        one.rename(other)
        (aside / "other").rename(one)


@contextmanager
def _locked(make: Callable[[], Path]) -> Iterator[Path]:
    """Yield what `make` makes, locked, so that nobody takes it for abandoned."""
    while True:
        path = make()
        handle = os.open(path, os.O_RDONLY)
        try:
            with contextlib.suppress(OSError):  # file systems without locks: then nothing is ever removed
                fcntl.flock(handle, fcntl.LOCK_EX)
            if path.exists():  # else somebody took it for abandoned before it was locked
                yield path
                return
        finally:
            os.close(handle)


def _remove_abandoned(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink()
    finally:
        os.close(handle)


def is_file(path: Path) -> bool:
    """Whether there is such a file; not where no file can have such a name (too long, a null character)."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
