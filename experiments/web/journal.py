"""The journal of a session: one record after the other, each with its length and checksum.

What is in it when `sync` returns survives the death of the process and of the machine. A record that was cut off by
either is dropped when the journal is opened again.
"""

import errno
import fcntl
import os
import struct
import time
import zlib
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType

from experiments.errors import RecordError

JOURNAL = "journal.bin"  # in the folder of a session
MAGIC = b"mjsim journal 1\n"
_HEAD = struct.Struct("<II")  # length of the record, bytes, and its CRC-32
MAX_RECORD = 64 * 1024 * 1024  # bytes
LOCK_PATIENCE = 10.0  # s that a process which had the journal open has to end


class Journal:
    """A journal that is open for appending, by one process at a time; the file is made if it is not there.

    Args:
        path: The file.

    Attributes:
        records: The records that were there when it was opened; whoever has read them may drop them.

    Raises:
        RecordError: The file is no journal, or another process keeps it open.
        OSError: It cannot be read or written.
    """

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o600)
        try:
            _lock(self._file, path)
            content = path.read_bytes()
            self.records = tuple(_records(content, path))
            intact = len(MAGIC) + sum(_HEAD.size + len(record) for record in self.records)
            if len(content) < len(MAGIC):
                os.ftruncate(self._file, 0)
                _write(self._file, MAGIC)
                sync_folder(path.parent)
            elif intact < len(content):
                os.ftruncate(self._file, intact)
            os.fsync(self._file)
        except BaseException:
            os.close(self._file)
            raise

    def append(self, record: bytes) -> None:
        """Append a record; it is safe once `sync` has returned.

        Raises:
            OSError: It cannot be written (a full disk); nothing of it stays in the file.
        """
        end = os.fstat(self._file).st_size
        try:
            _write(self._file, _HEAD.pack(len(record), zlib.crc32(record)) + record)
        except OSError:
            os.ftruncate(self._file, end)
            raise

    def sync(self) -> None:
        """Wait until everything appended so far is on the disk."""
        os.fdatasync(self._file)

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)

    def __enter__(self) -> "Journal":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def read_journal(path: Path) -> tuple[bytes, ...]:
    """The intact records of a journal.

    Raises:
        RecordError: The file is no journal.
        OSError: It cannot be read.
    """
    return tuple(_records(path.read_bytes(), path))


def sync_folder(folder: Path) -> None:
    """Wait until the names in a folder are on the disk."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _records(content: bytes, path: Path) -> Iterator[bytes]:
    """Records up to the first one that is cut off or damaged: what follows it was never acknowledged."""
    if not MAGIC.startswith(content[: len(MAGIC)]):
        raise RecordError(f"{path} is not the journal of a session")
    place = len(MAGIC)
    while place + _HEAD.size <= len(content):
        length, checksum = _HEAD.unpack_from(content, place)
        record = content[place + _HEAD.size : place + _HEAD.size + length]
        if length > MAX_RECORD or len(record) < length or zlib.crc32(record) != checksum:
            return
        yield record
        place += _HEAD.size + length


def _lock(file: int, path: Path) -> None:
    """Wait until no other process has the file open: one that lost its server takes a moment to notice."""
    until = time.monotonic() + LOCK_PATIENCE
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
