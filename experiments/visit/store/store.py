"""The store, which contains the participants, progress, answers and payments of a study."""

import sqlite3
from collections.abc import Awaitable, Callable, Mapping
from contextlib import closing, suppress
from pathlib import Path
from typing import Any, Self

from sqlalchemy import insert, select, update
from sqlalchemy.ext.asyncio import AsyncConnection as Connection

from experiments.errors import StoreError
from experiments.visit.store.assignments import Assignments
from experiments.visit.store.copies import back_up, one_file
from experiments.visit.store.engine import Database
from experiments.visit.store.erasure import Erasure
from experiments.visit.store.hosts import Hosts
from experiments.visit.store.ledger import Ledger
from experiments.visit.store.part import columns_of, new_id, note, transaction
from experiments.visit.store.people import People
from experiments.visit.store.phases import Endings, Phases
from experiments.visit.store.researchers import PASSWORD_MEMORY_KIB, Researchers
from experiments.visit.store.tables import audit, study
from experiments.visit.store.upgrade import upgrade
from experiments.visit.store.values import AuditRow, StudyRow, StudyState, utc_now


class Store(People, Assignments, Phases, Endings, Erasure, Hosts):
    """Database access for one study. Changes are on disk when a method returns.

    All methods raise :class:`~experiments.errors.StoreError` if the database fails.

    Attributes:
        researchers: Accounts of researchers, which are shared by all studies in a database.
    """

    def __init__(self, database: Database, study_id: int, password_memory_kib: int) -> None:
        super().__init__(database, study_id)
        self.ledger = Ledger(database, study_id)
        self.researchers = Researchers(database, password_memory_kib)

    @classmethod
    async def open(
        cls,
        url: str,
        study_name: str,
        file_hash: str,
        *,
        create: bool = True,
        alone: bool = False,
        password_memory_kib: int = PASSWORD_MEMORY_KIB,
    ) -> Self:
        """Open a database, create or upgrade its tables, and find or add the study.

        Args:
            url: `sqlite:///FILE`, `mysql://USER:PASSWORD@HOST/NAME` or `postgresql://USER:PASSWORD@HOST/NAME`.
            study_name: Name of the study. A database may hold several.
            file_hash: Hexadecimal SHA-256 of the study file. If it has changed, this is recorded in the audit log.
            create: False to raise StoreError if the database has no such study.
            alone: True to raise StoreError if the study would have to be added to another one.
            password_memory_kib: Memory needed to hash a researcher's password, in KiB.
        """
        database = Database(url)
        try:
            await database.check_durable()
            await upgrade(database, create=create)
            number = await _study_id(database, study_name, file_hash, create, alone)
            return cls(database, number, password_memory_kib)
        except BaseException:
            await database.close()
            raise

    async def close(self) -> None:
        await self._database.close()

    def on_write(self, tell: Callable[[float], None]) -> None:
        """Register a function that is called with the duration of each write, in seconds."""
        self._database.on_write = tell

    def is_at(self, path: Path) -> bool:
        """Return True if the database is the SQLite file at `path`."""
        return (
            self._database.kind == "sqlite"
            and path.resolve() == Path(self._database.url.database or "").resolve()
        )

    async def backup(self, path: Path) -> None:
        """Write a consistent snapshot of the database to a new SQLite file. The study may be running."""
        await back_up(self._database, path)

    async def study(self) -> StudyRow:
        (row,) = await self._database.rows(select(study).where(study.c.id == self._study_id))
        quotas = {int(cell): wanted for cell, wanted in row.quotas.items()}
        return StudyRow(row.id, row.name, row.file_hash, row.state, row.created, quotas)

    @transaction
    async def set_state(self, connection: Connection, state: StudyState, who: str) -> None:
        """Open, pause or close the study."""
        await connection.execute(update(study).where(study.c.id == self._study_id).values(state=state))
        await note(connection, self._study_id, who, f"study {state}", {}, utc_now())

    @transaction
    async def audit(
        self, connection: Connection, who: str, action: str, details: Mapping[str, Any] | None = None
    ) -> None:
        """Add an entry to the audit log. Refer to participants by number, never by platform id."""
        await note(connection, self._study_id, who, action, details or {}, utc_now())

    async def audit_log(self) -> tuple[AuditRow, ...]:
        query = select(*columns_of(AuditRow, audit)).where(audit.c.study_id == self._study_id)
        found = await self._database.rows(query.order_by(audit.c.id))
        return tuple(AuditRow(*row) for row in found)


async def change_database(path: Path, study_name: str, work: Callable[[Store], Awaitable[bool]]) -> bool:
    """Call `work` with the store of a study in a SQLite file, such as a backup, and return the result.

    Raises StoreError if the file cannot be read or changed.
    """
    try:
        with closing(sqlite3.connect(path)) as connection:
            row = connection.execute("SELECT file_hash FROM study WHERE name = ?", (study_name,)).fetchone()
    except sqlite3.DatabaseError as error:
        raise StoreError(f"cannot read {path} ({error}): delete it.") from error
    if row is None:
        return False
    store = await Store.open(f"sqlite:///{path}", study_name, row[0])
    try:
        return await work(store)
    finally:
        await store.close()
        with suppress(sqlite3.OperationalError):  # another process may have the file open
            one_file(path)


async def _study_id(database: Database, name: str, file_hash: str, create: bool, alone: bool) -> int:
    now = utc_now()

    async def work(connection: Connection) -> int:
        columns = (study.c.id, study.c.file_hash)
        row = (
            await connection.execute(select(*columns).where(study.c.name == name).with_for_update())
        ).first()
        if row is None:
            names = (await connection.execute(select(study.c.name))).scalars().all()
            if (alone and names) or not create:
                raise StoreError(
                    f"The database {database.name} has no study {name!r} (it has: {', '.join(names) or 'none'}): name "
                    "its study file, or the folder of this study."
                )
            made = await connection.execute(
                insert(study).values(name=name, file_hash=file_hash, state="open", created=now, quotas={})
            )
            return new_id(made)
        if row.file_hash != file_hash:
            await connection.execute(update(study).where(study.c.id == row.id).values(file_hash=file_hash))
            change = {"before": row.file_hash, "now": file_hash}
            await note(connection, row.id, "mjsim", "study file changed", change, now)
        return int(row.id)

    return await database.write(work)
