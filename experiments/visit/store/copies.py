"""Back up and restore databases. A backup is a SQLite file that can be restored into any database."""

import os
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory

from sqlalchemy import func, insert, select, text
from sqlalchemy.ext.asyncio import AsyncConnection

from experiments.errors import StoreError
from experiments.visit.store.engine import Database
from experiments.visit.store.tables import metadata
from experiments.visit.store.upgrade import upgrade
from mjsim.support.files import work_folder

ROWS = 1000  # maximum number of rows per INSERT statement
TAKEN = "{} is there already: name a new file for the backup."


def check_new(path: Path) -> None:
    """Raise StoreError if the backup file already exists, or OSError if its folder does not."""
    if os.path.lexists(path):
        raise StoreError(TAKEN.format(path))
    os.scandir(path.parent).close()


async def back_up(source: Database, path: Path) -> None:
    """Atomically write a consistent snapshot of the database to a new SQLite file.

    Raises StoreError if the file exists or cannot be written.
    """
    check_new(path)
    with work_folder(path.parent) as folder:  # an interrupted backup leaves no files
        part = folder / "backup.db"
        target = Database(f"sqlite:///{part}")
        try:
            await upgrade(target)
            await _copy(source, target)
        finally:
            await target.close()
        one_file(part)
        try:
            os.link(part, path)  # unlike a rename, this fails if the backup exists
        except FileExistsError as error:
            raise StoreError(TAKEN.format(path)) from error
        except OSError:  # the file system does not support links
            part.rename(path)


def one_file(path: Path) -> None:
    """Checkpoint the WAL of a SQLite database, restrict the file to mode 0600, and flush it to disk."""
    with closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA journal_mode = DELETE")
    path.chmod(0o600)  # only the owner may read the platform ids in the file
    with path.open("rb") as file:
        os.fsync(file.fileno())


async def restore(path: Path, url: str) -> None:
    """Restore a backup into an empty database.

    Args:
        path: Backup file, as written by :meth:`Store.backup`.
        url: URL of the empty database, in the form that :meth:`Store.open` accepts.

    Raises:
        StoreError: The backup is missing or damaged, or the database is not empty.
    """
    if not path.is_file():
        raise StoreError(f"There is no backup {path}.")
    with TemporaryDirectory() as folder:  # upgrading must not change the original file
        copy = shutil.copyfile(path, Path(folder, "backup.db"))
        source, target = Database(f"sqlite:///{copy}"), Database(url)
        try:
            try:
                await source.check()
                await upgrade(source, create=False)
            except StoreError as error:  # the message must not name the temporary copy
                raise StoreError(str(error).replace(source.name, str(path))) from error
            if not await _rows(source):
                raise StoreError(f"The backup {path} holds no study: name a file of `mjsim study backup`.")
            await upgrade(target)
            if await _rows(target):
                raise StoreError(f"The database {target.name} is not empty: restore into a new one.")
            await _copy(source, target)
        finally:
            await source.close()
            await target.close()


async def _rows(database: Database) -> int:
    async with database.reading() as connection:
        counts = [
            (await connection.execute(select(func.count()).select_from(table))).scalar_one()
            for table in metadata.sorted_tables
        ]
    return sum(counts)


async def _copy(source: Database, target: Database) -> None:
    async with source.snapshot() as reading:

        async def work(writing: AsyncConnection) -> None:
            for table in metadata.sorted_tables:
                found = await reading.stream(select(table).order_by(table.c.id))
                async for rows in found.mappings().partitions(ROWS):
                    await writing.execute(insert(table), [dict(row) for row in rows])
                if target.kind == "postgresql":  # explicit ids do not advance PostgreSQL's sequences
                    last = (await writing.execute(select(func.max(table.c.id)))).scalar() or 0
                    after = f"pg_get_serial_sequence('{table.name}', 'id'), {last + 1}, false"
                    await writing.execute(text(f"SELECT setval({after})"))

        await target.write(work)
