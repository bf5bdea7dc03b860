"""SQLite connections for asyncio. To save time, fast statements run directly in the event loop."""

import sqlite3
from collections.abc import Callable
from typing import Any

import aiosqlite

QUICK = ("SELECT", "INSERT", "UPDATE", "DELETE", "SAVEPOINT", "RELEASE", "ROLLBACK")
SLOW = ("Connection.commit", "Connection.close")


class SqliteConnection(aiosqlite.Connection):
    """A connection that only uses a thread for operations that may wait for a lock or the disk.

    In WAL mode, reads never wait, and neither do writes, because their transaction already has the lock.
    """

    async def _execute(self, fn: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
        name = fn.__qualname__
        waits = name in SLOW or (name.endswith(".execute") and not args[0].lstrip().startswith(QUICK))
        if waits or self._connection is None:
            return await super()._execute(fn, *args, **kwargs)  # type: ignore[no-untyped-call]
        return fn(*args, **kwargs)


def sqlite_connection(database: str, **options: Any) -> SqliteConnection:
    """Create an unopened connection, as required for SQLAlchemy's `async_creator_fn`."""
    connection = SqliteConnection(
        lambda: sqlite3.connect(database, **{**options, "check_same_thread": False}), iter_chunk_size=64
    )
    connection._thread.daemon = True
    return connection
