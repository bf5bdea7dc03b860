"""The journal of a session: its record as a file that is appended to while the session runs.

A header, then entries, each with its length and checksum. What is in it when `sync` returns survives the death of the
process and of the machine. An entry that was cut off by either is dropped when the journal is opened again.
"""

import errno
import fcntl
import os
import struct
import time
import zlib
from pathlib import Path
from types import TracebackType
from typing import Any

import msgspec

from experiments.errors import RecordError

JOURNAL = "journal.bin"  # in the folder of a session
MAGIC = b"mjsim journal 2\n"
MAX_ENTRY = 64 * 1024 * 1024  # bytes
LOCK_TIMEOUT = 10.0  # s that a process which has the journal open is given to end
_OTHER_VERSION = "another version of mjsim; use that version to continue the session"
_HEAD = struct.Struct("<II")  # length of an entry, bytes, and its CRC-32


class Header(msgspec.Struct, frozen=True, tag=True):
    """First entry: what is recorded.

    Attributes:
        settings: Settings of the trial.
        episode: The episode, as JSON.
    """

    settings: dict[str, Any]
    episode: str


class Checkpoint(msgspec.Struct, frozen=True):
    """A state from which to continue: the control step that follows it, its physics (float64), and the rest as JSON."""

    step: int
    physics: bytes
    details: str


class Entry(msgspec.Struct, frozen=True, tag=True):
    """What was recorded since the entry before.

    Attributes:
        rows: Control steps, of `columns.row_type`.
        events: Lines of the log.
        unknown: Names in actions that are no object of the house, so far.
        checkpoints: States that the world was set to.
        participant: State of the participant.
    """

    rows: bytes
    events: list[str]
    unknown: list[str] = []
    checkpoints: list[Checkpoint] = []
    participant: Any = None


_encode = msgspec.msgpack.Encoder().encode
_DECODER: msgspec.msgpack.Decoder[Header | Entry] = msgspec.msgpack.Decoder(Header | Entry)


class Journal:
    """A journal that is open for appending, by one process at a time; the file is made if it is not there.

    Args:
        path: The file.

    Attributes:
        entries: The entries that it had when it was opened; a reader of them may drop them.

    Raises:
        RecordError: The file is no journal, or another process keeps it open.
        OSError: It cannot be read or written.
    """

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o600)
        try:
            _lock(self._file, path)
            content = path.read_bytes()
            self.entries, end = _intact(content, path)
            if len(content) < len(MAGIC):
                os.ftruncate(self._file, 0)
                _write(self._file, MAGIC)
                sync_folder(path.parent)
            elif end < len(content):
                os.ftruncate(self._file, end)
            os.fsync(self._file)
        except BaseException:
            os.close(self._file)
            raise

    def append(self, entry: Header | Entry) -> None:
        """Append an entry; it is safe once `sync` has returned.

        Raises:
            OSError: It cannot be written (a full disk); nothing of it stays in the file.
        """
        end, content = self.size, _encode(entry)
        try:
            _write(self._file, _HEAD.pack(len(content), zlib.crc32(content)) + content)
        except OSError:
            os.ftruncate(self._file, end)
            raise

    @property
    def size(self) -> int:
        return os.fstat(self._file).st_size

    def sync(self) -> None:
        """Wait until everything appended so far is on the disk."""
        os.fdatasync(self._file)

    def close(self) -> None:
        os.close(self._file)

    def __enter__(self) -> "Journal":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def read_entries(path: Path) -> tuple[Header | Entry, ...]:
    """The intact entries of a journal; raises `RecordError` and `OSError` as `Journal` does."""
    return _intact(path.read_bytes(), path)[0]


def sync_folder(folder: Path) -> None:
    """Wait until the names in a folder, or the content of a file, are on the disk."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _intact(content: bytes, path: Path) -> tuple[tuple[Header | Entry, ...], int]:
    """Entries up to the first one that is cut off or damaged, and where it starts; the rest was never acknowledged."""
    if not MAGIC.startswith(content[: len(MAGIC)]):
        if content.startswith(MAGIC[:-2]):
            raise RecordError(f"{path} is a journal of {_OTHER_VERSION}")
        raise RecordError(f"{path} is not the journal of a session")
    place, entries = len(MAGIC), list[Header | Entry]()
    while place + _HEAD.size <= len(content):
        length, checksum = _HEAD.unpack_from(content, place)
        entry = content[place + _HEAD.size : place + _HEAD.size + length]
        if length > MAX_ENTRY or len(entry) < length or zlib.crc32(entry) != checksum:
            break
        try:
            entries.append(_DECODER.decode(entry))
        except msgspec.DecodeError as error:
            raise RecordError(f"{path} is a journal of {_OTHER_VERSION} ({error})") from error
        place += _HEAD.size + length
    return tuple(entries), place


def _lock(file: int, path: Path) -> None:
    """Wait until no other process has the file open, as one that lost its server takes a moment to end."""
    until = time.monotonic() + LOCK_TIMEOUT
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except OSError as error:
            if error.errno not in (errno.EAGAIN, errno.EACCES):
                raise
            if time.monotonic() > until:
                raise RecordError(f"{path} is in use by another process; end that process") from error
        time.sleep(0.02)


def _write(file: int, content: bytes) -> None:
    while content:
        content = content[os.write(file, content) :]
