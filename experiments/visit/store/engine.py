"""The connection to the database: short transactions, safe retries, and errors with remedies."""

import asyncio
import random
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, TypeVar

from sqlalchemy import URL, Connection, event, make_url, text
from sqlalchemy.exc import ArgumentError, DBAPIError, IntegrityError, NoSuchModuleError, SQLAlchemyError
from sqlalchemy.ext.asyncio import AsyncConnection, AsyncEngine, create_async_engine

from experiments.errors import StoreError
from experiments.visit.store.failures import advice, damaged, passes
from experiments.visit.store.sqlite import sqlite_connection

T = TypeVar("T")
_Waiting = tuple[Callable[[AsyncConnection], Awaitable[Any]], asyncio.Future[Any]]

DRIVERS = {
    "sqlite": "sqlite+aiosqlite",
    "mysql": "mysql+aiomysql",
    "mariadb": "mysql+aiomysql",
    "postgresql": "postgresql+psycopg",
}
PRAGMAS = (
    "PRAGMA journal_mode = WAL",
    "PRAGMA synchronous = FULL",  # commits are durable
    "PRAGMA foreign_keys = ON",
    "PRAGMA secure_delete = ON",  # overwrite deleted rows
)
# Server settings, each with the values that make commits durable.
DURABLE: dict[str, dict[str, tuple[str, ...]]] = {
    "mysql": {"@@innodb_flush_log_at_trx_commit": ("1",)},
    "postgresql": {
        "current_setting('fsync')": ("on",),
        "current_setting('synchronous_commit')": ("on", "local", "remote_write", "remote_apply"),
    },
}
PATIENCE_S = 20  # timeout for locks and new connections, in seconds
TURN_S = 60  # timeout for a pooled connection, in seconds
TRIES = 9
CONNECTIONS = 10  # size of the connection pool
TOGETHER = 64  # maximum number of writes per SQLite transaction
PAUSE_S = 0.01  # base of the exponential delay between tries, in seconds


class _UnknownError(StoreError):
    """A commit failed with an unknown outcome."""


class Database:
    """A database: SQLite, MariaDB or PostgreSQL."""

    def __init__(self, url: str) -> None:
        """Parse the URL, without connecting. Raises StoreError if it is not valid."""
        self.url = _parsed(url)
        self._engine = _engine(self.url)
        self._sqlite = self.kind == "sqlite"
        # called with the duration of each write, in seconds
        self.on_write: Callable[[float], None] = lambda _: None
        self._turn = asyncio.Lock()  # SQLite allows one writer at a time
        self._waiting: list[_Waiting] = []
        self._writer: asyncio.Task[None] | None = None

    @property
    def kind(self) -> str:
        """`sqlite`, `mysql` (also for MariaDB) or `postgresql`."""
        return self.url.get_backend_name()

    @property
    def name(self) -> str:
        """URL without the password."""
        return self.url.render_as_string(hide_password=True)

    async def close(self) -> None:
        await self._engine.dispose()

    @asynccontextmanager
    async def reading(self) -> AsyncIterator[AsyncConnection]:
        """Connect for reading. Each statement sees everything committed so far."""
        async with self._connection(begin="") as connection:
            yield connection

    @asynccontextmanager
    async def snapshot(self) -> AsyncIterator[AsyncConnection]:
        """Connect for reading a consistent snapshot."""
        options = {"begin": "BEGIN"} if self._sqlite else {"isolation_level": "REPEATABLE READ"}
        async with self._connection(**options) as connection:
            yield connection

    async def scrub(self) -> None:
        """Vacuum a SQLite file and truncate its WAL, so that deleted rows are gone from both.

        Raises StoreError if the WAL cannot be truncated because the database is in constant use.
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
        """Raise StoreError if a SQLite file is damaged."""
        if self._sqlite:
            async with self._connection(begin="") as connection:
                found = (await connection.execute(text("PRAGMA integrity_check(1)"))).scalar()
            if found != "ok":
                raise StoreError(damaged(self.name))

    async def check_durable(self) -> None:
        """Raise StoreError if the server may confirm a commit before it is on disk."""
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
        """Connect. Retry for some seconds if the server is still starting."""
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

        It is run again after a deadlock, a conflict or a lost connection, so it must only use the connection. If the
        connection is lost during the commit, the outcome is unknown and an error is raised.

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
        """Run waiting work in groups, since a transaction spends most of its time waiting for the disk."""
        while self._waiting:
            group, self._waiting = self._waiting[:TOGETHER], self._waiting[TOGETHER:]
            if len(group) > 1 and await self._write_group(group, alone=False):
                continue
            for one in group:  # a single one, or a group that failed without being written
                await self._write_group([one], alone=True)

    async def _write_group(self, group: Sequence[_Waiting], *, alone: bool) -> bool:
        """Write a group in one transaction. Return False if its members must be written one by one."""
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
                if not done.done():  # the caller was cancelled
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
    try:
        parsed = make_url(url)
        return parsed.set(drivername=DRIVERS[parsed.get_backend_name()])
    except (ArgumentError, KeyError, NoSuchModuleError) as error:
        raise StoreError(
            f"{url.partition('://')[0]!r} begins no database URL that is known. Use sqlite:///FILE, "
            "mysql://USER:PASSWORD@HOST/NAME or postgresql://USER:PASSWORD@HOST/NAME."
        ) from error


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
            max_overflow=0,  # a connection is a thread; waiting for one is faster than starting one
        )
        event.listen(engine.sync_engine, "connect", _prepare)
        event.listen(engine.sync_engine, "begin", _begin)
        return engine
    # Every statement sees committed rows. Rows that must not change are locked explicitly.
    return create_async_engine(
        url,
        hide_parameters=True,
        isolation_level="READ COMMITTED",
        pool_pre_ping=True,
        pool_timeout=TURN_S,
        pool_size=CONNECTIONS,
    )


def _prepare(connection: Any, record: Any) -> None:  # noqa: ARG001
    connection.isolation_level = None  # keeps the driver from starting transactions
    cursor = connection.cursor()
    for pragma in PRAGMAS:
        cursor.execute(pragma)
    cursor.close()


def _begin(connection: Connection) -> None:
    """Start a transaction.

    A transaction that will write takes the lock at once, since it may fail to get it after reading.
    """
    if statement := connection.get_execution_options()["begin"]:
        connection.exec_driver_sql(statement)


async def _pause(attempt: int) -> None:
    """Wait before a retry. All waits together take about five seconds."""
    share = random.uniform(0.5, 1.5)  # nosec B311  # no secret
    await asyncio.sleep(PAUSE_S * 2**attempt * share)


def _again(error: SQLAlchemyError, attempt: int) -> bool:
    """Return True if a retry may succeed. A conflict of two writers is retried once."""
    return passes(error) or (isinstance(error, IntegrityError) and attempt == 1)
