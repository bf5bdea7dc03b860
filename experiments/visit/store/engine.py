"""Database connections with short transactions, safe retries and helpful error messages."""

import asyncio
import random
import sqlite3
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from itertools import count
from pathlib import Path
from typing import Any, TypeVar

from sqlalchemy import URL, Connection, Select, event, make_url, text
from sqlalchemy.exc import ArgumentError, DBAPIError, IntegrityError, NoSuchModuleError, SQLAlchemyError
from sqlalchemy.ext.asyncio import AsyncConnection, AsyncEngine, create_async_engine
from sqlalchemy.util import await_only

from experiments.errors import StoreError
from experiments.visit.store.failures import advice, damaged, passes
from experiments.visit.store.sqlite import sqlite_connection
from mjsim.support.urls import redacted

T = TypeVar("T")
_Waiting = tuple[Callable[[AsyncConnection], Awaitable[Any]], asyncio.Future[Any]]

DRIVERS = {
    "sqlite": "sqlite+aiosqlite",
    "mysql": "mysql+aiomysql",
    "mariadb": "mysql+aiomysql",
    "postgresql": "postgresql+psycopg",
}
PRAGMAS = (
    "PRAGMA synchronous = FULL",  # makes commits durable
    "PRAGMA foreign_keys = ON",
    "PRAGMA secure_delete = ON",  # overwrites the content of deleted rows
)
# Server settings that affect durability, with the values that make commits durable
DURABLE: dict[str, dict[str, tuple[str, ...]]] = {
    "mysql": {"@@innodb_flush_log_at_trx_commit": ("1",)},
    "postgresql": {
        "current_setting('fsync')": ("on",),
        "current_setting('synchronous_commit')": ("on", "local", "remote_write", "remote_apply"),
    },
}
PATIENCE_S = 20  # timeout for locks and for new connections, in seconds
TURN_S = 60  # timeout for obtaining a connection from the pool, in seconds
TRIES = 9
CONNECTIONS = 10
TOGETHER = 64  # maximum number of writes per SQLite transaction
PAUSE_S = 0.01  # delay before a retry, in seconds; it doubles with each attempt


class _UnknownError(StoreError):
    """Raised if a commit failed and it is unknown whether the data were saved."""


class Database:
    """A SQLite, MariaDB or PostgreSQL database."""

    def __init__(self, url: str) -> None:
        """Parse the URL without connecting to the database. Raises StoreError if the URL is not valid."""
        self.url = _parsed(url)
        self._engine = _engine(self.url)
        self._sqlite = self.kind == "sqlite"
        # Callback that receives the duration of each write, in seconds
        self.on_write: Callable[[float], None] = lambda _: None
        self._turn = asyncio.Lock()  # SQLite allows only one writer at a time
        self._waiting: list[_Waiting] = []
        self._writer: asyncio.Task[None] | None = None

    @property
    def kind(self) -> str:
        """The database system: `sqlite`, `mysql` (also for MariaDB) or `postgresql`."""
        return self.url.get_backend_name()

    @property
    def name(self) -> str:
        """The database's URL, without the password."""
        return redacted(self.url.render_as_string(hide_password=True))

    async def close(self) -> None:
        await self._engine.dispose()

    @asynccontextmanager
    async def reading(self) -> AsyncIterator[AsyncConnection]:
        """Open a connection for reading. Each statement sees all data that were committed before it."""
        async with self._connection(begin="") as connection:
            yield connection

    async def rows(self, query: Select[Any], values: Mapping[str, Any] | None = None) -> list[Any]:
        async with self.reading() as connection:
            return list(await connection.execute(query, values))

    @asynccontextmanager
    async def snapshot(self) -> AsyncIterator[AsyncConnection]:
        """Open a connection that reads from a consistent snapshot of the database."""
        options = {"begin": "BEGIN"} if self._sqlite else {"isolation_level": "REPEATABLE READ"}
        async with self._connection(**options) as connection:
            yield connection

    async def scrub(self) -> None:
        """Vacuum a SQLite file and truncate its WAL so that neither contains deleted rows.

        Raises StoreError if the WAL cannot be truncated because other connections are using it.
        """
        if not self._sqlite:
            return
        async with self._alone(), self._connection(begin="") as connection:
            await connection.execute(text("VACUUM"))
            emptied = (await connection.execute(text("PRAGMA wal_checkpoint(TRUNCATE)"))).one()
        if emptied[0]:
            raise StoreError(
                f"The log of {self.name} is in use, and holds what was deleted: do it again later."
            )

    async def check(self) -> None:
        """Raise StoreError if the database is a damaged SQLite file."""
        if self._sqlite:
            async with self._connection(begin="") as connection:
                found = (await connection.execute(text("PRAGMA integrity_check(1)"))).scalar()
            if found != "ok":
                raise StoreError(damaged(self.name))

    async def check_durable(self) -> None:
        """Raise StoreError if the server's settings allow a commit to be confirmed before it is on disk."""
        if self._sqlite:
            return
        async with self.reading() as connection:
            for setting, safe in DURABLE[self.kind].items():
                value = (await connection.execute(text(f"SELECT {setting}"))).scalar()
                if str(value) not in safe:
                    raise StoreError(
                        f"The database {self.name} may lose what it has confirmed, as {setting} is {value}: "
                        f"set it to {safe[0]}."
                    )

    @asynccontextmanager
    async def _connection(self, **options: Any) -> AsyncIterator[AsyncConnection]:
        try:
            connection = await self._connected()
            try:
                if options:
                    await connection.execution_options(**options)
                yield connection
            finally:
                await connection.close()
        except SQLAlchemyError as error:
            raise StoreError(advice(error, self.name)) from error

    async def _connected(self) -> AsyncConnection:
        for attempt in range(1, TRIES):
            try:
                return await self._engine.connect()
            except SQLAlchemyError as error:
                if not passes(error):
                    raise
            await _pause(attempt)
        return await self._engine.connect()

    async def write(self, work: Callable[[AsyncConnection], Awaitable[T]]) -> T:
        """Run `work` in one transaction and return its result after the commit.

        After a deadlock, a conflict or a lost connection, `work` is called again, so it must have no other
        side effects. A connection that is lost during the commit is an error, as the outcome is unknown.

        Raises StoreError if the database fails.
        """
        began = time.monotonic()
        if self._sqlite:
            done: asyncio.Future[T] = asyncio.get_running_loop().create_future()
            self._waiting.append((work, done))
            if self._writer is None or self._writer.done():
                self._writer = asyncio.create_task(self._write_waiting())
            result = await done
        else:
            [result] = await self._persist([work])
        self.on_write(time.monotonic() - began)
        return result

    async def _write_waiting(self) -> None:
        """Run all queued writes in groups. Each group shares a transaction, to save disk writes."""
        while self._waiting:
            group, self._waiting = self._waiting[:TOGETHER], self._waiting[TOGETHER:]
            if len(group) > 1 and await self._write_group(group, alone=False):
                continue
            for one in group:  # runs a single write, or retries each write of a failed group
                await self._write_group([one], alone=True)

    async def _write_group(self, group: Sequence[_Waiting], *, alone: bool) -> bool:
        try:
            results = await self._persist([work for work, _ in group])
        except Exception as error:
            if not (alone or isinstance(error, _UnknownError)):
                return False
            for _, done in group:
                if not done.done():
                    done.set_exception(error)
        else:
            for (_, done), result in zip(group, results, strict=True):
                if not done.done():  # the future is done if the caller was cancelled
                    done.set_result(result)
        return True

    async def _persist(self, works: Sequence[Callable[[AsyncConnection], Awaitable[Any]]]) -> Sequence[Any]:
        for attempt in range(1, TRIES + 1):
            try:
                return await self._transaction(works)
            except SQLAlchemyError as error:
                if attempt == TRIES or not _again(error, attempt):
                    raise StoreError(advice(error, self.name)) from error
            await _pause(attempt)
        raise AssertionError

    async def _transaction(
        self, works: Sequence[Callable[[AsyncConnection], Awaitable[Any]]]
    ) -> Sequence[Any]:
        async with self._alone(), self._engine.connect() as connection:
            await connection.execution_options(begin="BEGIN IMMEDIATE")
            results = [await work(connection) for work in works]
            try:
                await connection.commit()
            except DBAPIError as error:
                raise _UnknownError(
                    f"{advice(error, self.name)} Whether the last change was saved is unknown."
                ) from error
            return results

    @asynccontextmanager
    async def _alone(self) -> AsyncIterator[None]:
        if not self._sqlite:
            yield
            return
        async with self._turn:
            yield


def _parsed(url: str) -> URL:
    shown = redacted(url) if "://" in url else "text without ://"
    try:
        parsed = make_url(url)
        if "@" in (parsed.host or ""):
            raise StoreError("The password in the database URL contains @: write %40 instead.")
        return parsed.set(drivername=DRIVERS[parsed.get_backend_name()])
    except (ArgumentError, KeyError, NoSuchModuleError, ValueError):  # the cause may contain the password
        raise StoreError(
            f"{shown!r} is not a database URL. Use sqlite:///FILE, mysql://USER:PASSWORD@HOST/NAME or "
            "postgresql://USER:PASSWORD@HOST/NAME."
        ) from None


def _engine(url: URL) -> AsyncEngine:
    if url.get_backend_name() == "sqlite":
        if not url.database or url.database == ":memory:":
            raise StoreError("A study's database must be kept: name a file, as in sqlite:///study.db.")
        if not Path(url.database).parent.is_dir():
            raise StoreError(
                f"There is no folder {Path(url.database).parent} for the database: make it first."
            )
        engine = create_async_engine(
            url,
            hide_parameters=True,
            connect_args={"timeout": PATIENCE_S, "async_creator_fn": sqlite_connection},
            pool_timeout=TURN_S,
            pool_size=CONNECTIONS,
            max_overflow=0,  # waiting for a free connection is faster than starting a new thread
        )
        event.listen(engine.sync_engine, "connect", _prepare)
        event.listen(engine.sync_engine, "begin", _begin)
        return engine
    # READ COMMITTED suffices, because rows that must not change are locked explicitly.
    return create_async_engine(
        url,
        hide_parameters=True,
        isolation_level="READ COMMITTED",
        pool_pre_ping=True,
        pool_timeout=TURN_S,
        pool_size=CONNECTIONS,
    )


def _prepare(connection: Any, record: Any) -> None:  # noqa: ARG001
    connection.isolation_level = None  # disables the driver's implicit transactions
    cursor = connection.cursor()
    _use_wal(cursor)
    for pragma in PRAGMAS:
        cursor.execute(pragma)
    cursor.close()


def _use_wal(cursor: Any) -> None:
    """Switch the file to WAL mode. If several connections try this at once, SQLite refuses without waiting."""
    until = time.monotonic() + PATIENCE_S
    for attempt in count(1):
        try:
            cursor.execute("PRAGMA journal_mode = WAL")
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode != sqlite3.SQLITE_BUSY or time.monotonic() > until:
                raise
            await_only(_pause(min(attempt, TRIES)))
        else:
            return


def _begin(connection: Connection) -> None:
    """Begin a transaction. Writers lock the database immediately, because SQLite may refuse a later lock."""
    if statement := connection.get_execution_options()["begin"]:
        connection.exec_driver_sql(statement)


async def _pause(attempt: int) -> None:
    share = random.uniform(0.5, 1.5)  # nosec B311  # no secret
    await asyncio.sleep(PAUSE_S * 2**attempt * share)


def _again(error: SQLAlchemyError, attempt: int) -> bool:
    """Return True if a retry may succeed. A constraint violation may be a race, so it is retried once."""
    return passes(error) or (isinstance(error, IntegrityError) and attempt == 1)
