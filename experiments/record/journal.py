"""Write the record of a running session to an append-only file, which is called the journal.

A journal consists of a header and entries, each with its length and checksum. After `sync`, entries survive a
crash of the process or machine. An incomplete last entry is dropped when the journal is opened again.
"""

import errno
import fcntl
import os
import struct
import time
import zlib
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import msgspec

from experiments.errors import RecordError

JOURNAL = "journal.bin"  # file name of the journal in a session's folder
MAGIC = b"mjsim journal 2\n"
MAX_ENTRY = 64 * 1024 * 1024  # maximum size of an entry in bytes
LOCK_TIMEOUT_S = 10.0  # how long to wait for another process to close the journal
_OTHER_VERSION = "another version of mjsim; use that version to continue the session"
_HEAD = struct.Struct("<II")  # length in bytes and CRC-32 of the next entry


class Header(msgspec.Struct, frozen=True, tag="Header"):
    """The first entry of a journal.

    Attributes:
        settings: Settings of the trial.
        episode: The episode, as JSON.
    """

    settings: dict[str, Any]
    episode: str


class Checkpoint(msgspec.Struct, frozen=True):
    """A state from which a session can be resumed, with float64 physics and other details as JSON."""

    step: int
    physics: bytes
    details: str


class JournalEntry(msgspec.Struct, frozen=True, tag="Entry"):
    """The part of a record that was added since the previous entry.

    Attributes:
        rows: Control steps, of type `columns.row_type`.
        events: New lines of the log.
        unknown: All names in actions so far that do not match an object.
        checkpoints: New checkpoints.
        participant: State of the participant.
    """

    rows: bytes
    events: list[str]
    unknown: list[str] = []
    checkpoints: list[Checkpoint] = []
    participant: Any = None


_encode = msgspec.msgpack.Encoder().encode
_DECODER: msgspec.msgpack.Decoder[Header | JournalEntry] = msgspec.msgpack.Decoder(Header | JournalEntry)


class Journal(AbstractContextManager["Journal"]):
    """A journal file, created if it is missing, which only one process can have open at a time.

    Attributes:
        entries: The entries that were in the file when it was opened. Clear this list to free memory.

    Raises:
        RecordError: The file is not a journal, or another process keeps it open.
        OSError: The file cannot be read or written.
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

    def append(self, entry: Header | JournalEntry) -> None:
        """Append an entry, which is durable only after `sync`. An OSError leaves the file unchanged."""
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
        os.fdatasync(self._file)

    def close(self) -> None:
        os.close(self._file)

    def __exit__(self, *_: object) -> None:
        self.close()


def read_entries(path: Path) -> tuple[Header | JournalEntry, ...]:
    return _intact(path.read_bytes(), path)[0]


def sync_folder(folder: Path) -> None:
    """Flush a file, or the directory entries of a folder, to disk."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _intact(content: bytes, path: Path) -> tuple[tuple[Header | JournalEntry, ...], int]:
    if not MAGIC.startswith(content[: len(MAGIC)]):
        if content.startswith(MAGIC[:-2]):
            raise RecordError(f"{path} is a journal of {_OTHER_VERSION}")
        raise RecordError(f"{path} is not the journal of a session")
    offset, entries = len(MAGIC), list[Header | JournalEntry]()
    while offset + _HEAD.size <= len(content):
        length, checksum = _HEAD.unpack_from(content, offset)
        entry = content[offset + _HEAD.size : offset + _HEAD.size + length]
        if length > MAX_ENTRY or len(entry) < length or zlib.crc32(entry) != checksum:
            break
        try:
            entries.append(_DECODER.decode(entry))
        except msgspec.DecodeError as error:
            raise RecordError(f"{path} is a journal of {_OTHER_VERSION} ({error})") from error
        offset += _HEAD.size + length
    return tuple(entries), offset


def _lock(file: int, path: Path) -> None:
    """Lock a journal file, and wait if another process still has it open."""
    until = time.monotonic() + LOCK_TIMEOUT_S
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
