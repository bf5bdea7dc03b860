"""Store run directories in SQLite archives, which can be read with `sqlite3 -A`.

Each worker process writes its own archive under a hidden name, and holds an exclusive SQLite lock until it
ends. An archive that is no longer locked is finished, and `adopt` renames it to its final name.
"""

import itertools
import os
import re
import secrets
import socket
import sqlite3
import tempfile
import zlib
from collections.abc import Collection, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from experiments.errors import RecordError
from experiments.record import records
from experiments.record.files import CHECKSUMS, read_checksums, sha256_of
from experiments.record.run_directory import PACKED, is_run
from mjsim.support.files import MAX_INPUT, read_bytes, work_folder

WAIT_S = 60.0  # how long to wait for another process that is writing to the archive
_SCHEMA = "CREATE TABLE IF NOT EXISTS sqlar(name TEXT PRIMARY KEY, mode INT, mtime INT, sz INT, data BLOB)"
_DAMAGED = "if it is damaged, move it away: its trials are run again"
_OF_RUN = "WHERE name >= ? || '/' AND name < ? || '0'"  # "0" follows "/" in ASCII


def new_archive(folder: Path, prefix: str) -> sqlite3.Connection:
    """Create an archive that no other process can open until the connection is closed."""
    while True:
        host = re.sub(r"[^\w.-]", "", socket.gethostname(), flags=re.ASCII)
        path = folder / f".{prefix}-{host}-{os.getpid()}-{secrets.token_hex(4)}{PACKED}"
        database = _connect(path, "rwc")
        # SQLite's journal is synced and never deleted, so a committed run survives a power failure.
        database.executescript(
            f"PRAGMA auto_vacuum=FULL; PRAGMA locking_mode=EXCLUSIVE; PRAGMA synchronous=FULL; {_SCHEMA};"
        )
        if path.exists():  # false if another process renamed it before it was locked
            return database
        database.close()


def pack(run: Path, database: sqlite3.Connection) -> None:
    """Add a run directory to an archive in one transaction. Raises `RecordError` if this is not possible."""
    rows = []
    for path in sorted(path for path in run.rglob("*") if path.is_file()):
        content, status = path.read_bytes(), path.stat()
        data = min(content, zlib.compress(content), key=len)
        name = path.relative_to(run.parent).as_posix()
        rows.append((name, status.st_mode, int(status.st_mtime), len(content), data))
    try:
        with database:
            database.executemany("INSERT OR REPLACE INTO sqlar VALUES (?, ?, ?, ?, ?)", rows)
    except sqlite3.Error as error:
        raise RecordError(f"cannot pack {run.name}: {error}; run it again once there is space") from error


def adopt(folder: Path, prefix: str = "", wait_s: float = 0.0) -> int:
    """Rename all finished archives to their final names. Return the number of archives still being written.

    Runs that were not committed before their writer was killed are rolled back.
    """
    busy = 0
    for path in sorted(folder.glob(f".{prefix}*{PACKED}")):
        try:
            with closing(_connect(path, "rw", wait_s)) as database:
                database.execute(_SCHEMA)
                database.execute("BEGIN EXCLUSIVE")
                empty = database.execute("SELECT 1 FROM sqlar").fetchone() is None
                if path.exists():  # false if another process renamed it first
                    path.with_name(f"{path.name}-journal").unlink(missing_ok=True)
                    path.unlink() if empty else path.rename(path.with_name(path.name[1:]))
        except sqlite3.Error as error:
            if error.sqlite_errorcode == sqlite3.SQLITE_BUSY:
                busy += 1
            elif path.exists():
                raise RecordError(f"cannot read {path}: {error}; {_DAMAGED}") from error
    return busy


def run_paths(folder: Path, prefix: str = "") -> list[Path]:
    """Return the paths of all runs in the `trials` folder of a batch, sorted by name.

    The path of a packed run is `FOLDER/ARCHIVE/NAME`. A run directory takes precedence over a packed run with
    the same name. Only archives whose names begin with `prefix` are read.

    Raises:
        RecordError: An archive is damaged.
    """
    found = {name: archive / name for archive in _archives(folder, prefix) for name in packed_names(archive)}
    with suppress(FileNotFoundError), os.scandir(folder) as entries:
        found |= {e.name: folder / e.name for e in entries if not e.name.startswith(".") and e.is_dir()}
    return [path for _, path in sorted(found.items())]


def packed_names(archive: Path) -> set[str]:
    with _opened(archive) as database:
        rows = database.execute("SELECT name FROM sqlar WHERE name GLOB ?", (f"*/{records.EVENTS}",))
        return {name.partition("/")[0] for (name,) in rows}


@contextmanager
def opened_run(path: Path) -> Iterator[Path]:
    """Yield the directory of a run. A packed run is unpacked first, which can raise `RecordError`."""
    archive = None if is_run(path) else archive_of(path)
    if archive is None:
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="mjsim-") as folder:
        unpack(archive, path.name, Path(folder))
        yield Path(folder) / path.name


def unpack(archive: Path, name: str, folder: Path) -> None:
    """Unpack a run from an archive to `folder/name`, and verify the checksums of its files."""
    directories = set[Path]()
    with _opened(archive) as database:
        members = f"SELECT name, mtime, sz, data FROM sqlar {_OF_RUN}"  # nosec B608 - a constant
        for member, mtime, size, data in database.execute(members, (name, name)):
            path = folder / member
            if not path.resolve().is_relative_to(folder.resolve()):
                raise RecordError(f"{archive}: {member} is not a valid file name in a run")
            content = _content(archive, member, size, data)
            path.parent.mkdir(parents=True, exist_ok=True)
            directories.add(path.parent)
            path.write_bytes(content)
            os.utime(path, (mtime, mtime))
    if not directories:
        raise RecordError(f"{archive} has no run {name}")
    for directory in sorted(directories):
        sums = read_checksums(directory)
        for path in {*map(directory.joinpath, sums), *filter(Path.is_file, directory.iterdir())}:
            if path.name != CHECKSUMS and (not path.exists() or sums.get(path.name) != sha256_of(path)):
                raise RecordError(f"{archive}: {path.relative_to(folder)} is damaged: its checksum differs")


def read_file(path: Path, file: str) -> bytes:
    """Read a file from a run directory or a packed run. The checksum of the file is not verified."""
    if path.parent.suffix != PACKED:
        return read_bytes(path / file)
    member = f"{path.name}/{file}"
    with _opened(path.parent) as database:
        row = database.execute("SELECT sz, data FROM sqlar WHERE name = ?", (member,)).fetchone()
    return _content(path.parent, member, *(row or (0, None)))


def unpack_in_place(folder: Path, runs: Collection[Path]) -> Iterator[str | None]:
    """Unpack runs in a batch folder. For each run, yield None or, if the run is damaged, an error message."""
    for archive, paths in itertools.groupby(sorted(runs), lambda path: path.parent):
        done = set()
        for path in paths:
            try:
                with work_folder(folder) as work:
                    unpack(archive, path.name, work)
                    if not is_run(folder / path.name):
                        (work / path.name).rename(folder / path.name)
            except RecordError as error:
                yield str(error)
                continue
            done.add(path.name)
            yield None
        os.sync()  # the files must be on disk before the packed runs are deleted
        discard(folder, done)


def discard(folder: Path, names: Collection[str], target: Path | None = None, prefix: str = "") -> None:
    """Delete packed runs from the archives in `folder`. If `target` is given, move them there instead."""
    for archive in _archives(folder, prefix):
        held = packed_names(archive)
        if held <= set(names):
            archive.unlink() if target is None else archive.rename(target / archive.name)
        elif gone := [(name, name) for name in held.intersection(names)]:
            with _opened(archive) as database:
                if target is not None:
                    new = target / f"{archive.stem}-{secrets.token_hex(4)}{PACKED}"
                    database.execute("ATTACH ? AS target", (f"{new.absolute().as_uri()}?mode=rwc",))
                    database.execute(_SCHEMA.replace("sqlar", "target.sqlar", 1))
                with database:  # one transaction that covers both archives
                    if target is not None:
                        insert = f"INSERT INTO target.sqlar SELECT * FROM main.sqlar {_OF_RUN}"  # nosec B608
                        database.executemany(insert, gone)
                    database.executemany(f"DELETE FROM main.sqlar {_OF_RUN}", gone)  # nosec B608


def copy(folder: Path, names: Collection[str], target: Path) -> None:
    """Copy packed runs from the archives in `folder` to archives in `target`."""
    for archive in _archives(folder):
        if held := packed_names(archive).intersection(names):
            with closing(new_archive(target, "merged")) as database:
                database.execute("ATTACH ? AS source", (archive.absolute().as_uri(),))
                insert = f"INSERT INTO sqlar SELECT * FROM source.sqlar {_OF_RUN}"  # nosec B608
                with database:
                    database.executemany(insert, [(name, name) for name in held])
    adopt(target, "merged")


def archive_of(path: Path) -> Path | None:
    if path.suffix == PACKED and path.is_file():
        raise RecordError(f"{path} holds packed runs; name one of them: {path.parent / 'NAME'}")
    if path.parent.suffix == PACKED and path.parent.is_file():
        return path.parent
    return next((archive for archive in _archives(path.parent) if path.name in packed_names(archive)), None)


def _content(archive: Path, member: str, size: int, data: bytes) -> bytes:
    try:
        return data if len(data) == size else zlib.decompressobj().decompress(data, MAX_INPUT)
    except (zlib.error, TypeError) as error:
        raise RecordError(f"{archive}: {member} is damaged ({error})") from error


def _archives(folder: Path, prefix: str = "") -> list[Path]:
    return sorted(folder.glob(f"{prefix or '[!.]'}*{PACKED}"))


def _connect(path: Path, mode: str, wait_s: float = WAIT_S) -> sqlite3.Connection:
    return sqlite3.connect(f"{path.absolute().as_uri()}?mode={mode}", timeout=wait_s, uri=True)


@contextmanager
def _opened(archive: Path) -> Iterator[sqlite3.Connection]:
    try:
        with closing(_connect(archive, "rw")) as database:
            yield database
    except sqlite3.Error as error:
        raise RecordError(f"cannot read {archive}: {error}; {_DAMAGED}") from error
