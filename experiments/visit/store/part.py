"""The base class for all parts of the store."""

import dataclasses
import functools
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from datetime import datetime
from typing import Any, Concatenate, ParamSpec, TypeVar

from sqlalchemy import Column, CursorResult, Table, func, insert, select
from sqlalchemy.ext.asyncio import AsyncConnection as Connection

from experiments.visit.store import tables
from experiments.visit.store.engine import Database

Owner = TypeVar("Owner")
Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")
_NOW = {
    "sqlite": func.current_timestamp(type_=tables.Utc),
    "mysql": func.utc_timestamp(6, type_=tables.Utc),
    "postgresql": func.timezone("UTC", func.now(), type_=tables.Utc),
}


class StorePart:
    """A base class for groups of store methods, which access the rows of one study."""

    def __init__(self, database: Database, study_id: int) -> None:
        self._database, self._study_id = database, study_id


def transaction(
    method: Callable[Concatenate[Owner, Connection, Arguments], Awaitable[Result]],
) -> Callable[Concatenate[Owner, Arguments], Coroutine[Any, Any, Result]]:
    """Give a method the connection of a new transaction, which is committed before the method returns.

    `Database.write` may run the method several times.
    """

    @functools.wraps(method)
    async def run(self: Any, /, *args: Arguments.args, **options: Arguments.kwargs) -> Result:
        database: Database = self._database
        return await database.write(lambda connection: method(self, connection, *args, **options))

    return run


def columns_of(row: type[Any], table: Table) -> list[Column[Any]]:
    """Return the columns of a table that are fields of a data class, in the order of the fields."""
    return [table.c[field.name] for field in dataclasses.fields(row) if field.name in table.c]


def new_id(inserted: CursorResult[Any]) -> int:
    key = inserted.inserted_primary_key
    return int(key[0]) if key else 0


async def database_now(connection: Connection) -> datetime:
    """Return the current time of the database's clock, which all hosts share."""
    return (await connection.execute(select(_NOW[connection.dialect.name]))).scalar_one()


async def lock_study(connection: Connection, study_id: int) -> dict[str, int]:
    """Lock the study's row until the transaction ends. Return all quotas that have been changed, by cell."""
    query = select(tables.study.c.quotas).where(tables.study.c.id == study_id).with_for_update()
    return dict((await connection.execute(query)).scalar_one())


async def note(
    connection: Connection,
    study_id: int,
    who: str,
    action: str,
    details: Mapping[str, Any],
    now: datetime,
) -> None:
    values = {"study_id": study_id, "at": now, "who": who, "action": action, "details": dict(details)}
    await connection.execute(insert(tables.audit).values(**values))
