"""Table definitions of a study's database. A test checks that the migrations create the same tables."""

import json
from datetime import UTC, datetime
from typing import Any

from sqlalchemy import (
    Boolean,
    Column,
    DateTime,
    Dialect,
    Double,
    ForeignKey,
    Integer,
    MetaData,
    SmallInteger,
    String,
    Table,
    Text,
    TypeDecorator,
    UniqueConstraint,
)
from sqlalchemy.dialects import mysql
from sqlalchemy.types import BigInteger

NAME = 100  # maximum length of names, phases, items and reasons, in characters
HASH = 64  # length of a SHA-256, in hexadecimal digits


class Utc(TypeDecorator[datetime]):
    """A column type for times with a timezone. They are stored in UTC, as some databases lack timezones."""

    impl = DateTime().with_variant(mysql.DATETIME(fsp=6), "mysql")
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:  # noqa: ARG002
        """Convert a time to UTC. Raises ValueError if it has no timezone."""
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"{value} has no time zone")
        return value.astimezone(UTC).replace(tzinfo=None)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:  # noqa: ARG002
        return None if value is None else value.replace(tzinfo=UTC)


class Json(TypeDecorator[Any]):
    """A column type for JSON values. They are stored as ASCII text, which every database preserves."""

    impl = Text().with_variant(mysql.MEDIUMTEXT(), "mysql")
    cache_ok = True

    def process_bind_param(self, value: Any, dialect: Dialect) -> str:  # noqa: ARG002
        """Encode a value as JSON. Raises ValueError for NaN and infinity, and TypeError for unsupported types."""
        return json.dumps(value, allow_nan=False, separators=(",", ":"))

    def process_result_value(self, value: str | None, dialect: Dialect) -> Any:  # noqa: ARG002
        return None if value is None else json.loads(value)


metadata = MetaData(
    naming_convention={
        "pk": "pk_%(table_name)s",
        "fk": "fk_%(table_name)s_%(column_0_name)s",
        "uq": "uq_%(table_name)s_%(column_0_N_name)s",
        "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    }
)

# Without these options, SQLite would reuse the ids of deleted rows, and MariaDB would ignore case.
OPTIONS: dict[str, Any] = {
    "sqlite_autoincrement": True,
    "mysql_engine": "InnoDB",
    "mysql_charset": "utf8mb4",
    "mysql_collate": "utf8mb4_bin",
}


def _id() -> Column[int]:
    return Column("id", Integer, primary_key=True)


def _of(table: str, *, unique: bool = False, index: bool = False) -> Column[int]:
    return Column(f"{table}_id", ForeignKey(f"{table}.id"), nullable=False, unique=unique, index=index)


study = Table(
    "study",
    metadata,
    _id(),
    Column("name", String(NAME), nullable=False, unique=True),
    Column("file_hash", String(HASH), nullable=False),
    Column("state", String(20), nullable=False),
    Column("created", Utc, nullable=False),
    Column("quotas", Json, nullable=False),
    **OPTIONS,
)

person = Table(
    "person",
    metadata,
    _id(),
    _of("study"),
    Column("token_hash", String(HASH), nullable=False, unique=True),
    Column("platform", String(20), nullable=False),
    Column("platform_key", String(HASH)),
    Column("status", String(20), nullable=False),
    Column("phase", String(NAME), nullable=False),
    Column("created", Utc, nullable=False),
    Column("seen", Utc, nullable=False),
    Column("delete_wanted", Boolean, nullable=False),
    Column("host", String(NAME)),  # host that runs the participant's trials; NULL if there is only one host
    UniqueConstraint("study_id", "platform_key"),
    **OPTIONS,
)

identity = Table(
    "identity",
    metadata,
    _id(),
    _of("person", unique=True),
    Column("ids", Json, nullable=False),
    **OPTIONS,
)

# `active` is 1 while a place is held or finished, and NULL once it is released. The unique constraint ignores NULL, so
# it ensures that each place has at most one participant.
assignment = Table(
    "assignment",
    metadata,
    _id(),
    _of("person", unique=True),
    _of("study"),
    Column("cell", Integer, nullable=False),
    Column("place", Integer, nullable=False),
    Column("active", SmallInteger),
    Column("state", String(20), nullable=False),
    Column("house_seed", BigInteger, nullable=False),
    Column("person_seed", BigInteger, nullable=False),
    Column("order_seed", BigInteger, nullable=False),
    Column("created", Utc, nullable=False),
    UniqueConstraint("study_id", "cell", "place", "active"),
    **OPTIONS,
)

host = Table(
    "host",
    metadata,
    _id(),
    _of("study"),
    Column("name", String(NAME), nullable=False),
    Column("seen", Utc, nullable=False),
    Column("draining", Boolean, nullable=False),
    UniqueConstraint("study_id", "name"),
    **OPTIONS,
)

phase = Table(
    "phase",
    metadata,
    _id(),
    _of("person"),
    Column("name", String(NAME), nullable=False),
    Column("shown", Utc, nullable=False),
    Column("ended", Utc),
    Column("duration_s", Double),
    Column("reason", String(NAME)),
    UniqueConstraint("person_id", "name"),
    **OPTIONS,
)

answer = Table(
    "answer",
    metadata,
    _id(),
    _of("person"),
    Column("phase", String(NAME), nullable=False),
    Column("item", String(NAME), nullable=False),
    Column("value", Json, nullable=False),
    Column("given", Utc, nullable=False),
    Column("final", Boolean, nullable=False),
    UniqueConstraint("person_id", "phase", "item"),
    **OPTIONS,
)

trial = Table(
    "trial",
    metadata,
    _id(),
    _of("person"),
    Column("phase", String(NAME), nullable=False),
    Column("folder", String(255), nullable=False),
    Column("ended", String(NAME), nullable=False),
    Column("finished", Utc, nullable=False),
    UniqueConstraint("person_id", "phase"),
    **OPTIONS,
)

payment = Table(
    "payment",
    metadata,
    _id(),
    _of("study"),
    _of("person", index=True),
    Column("key", String(NAME), nullable=False),
    Column("attempt", Integer, nullable=False),
    Column("event", String(20), nullable=False),
    Column("kind", String(20), nullable=False),
    Column("cents", Integer, nullable=False),
    Column("currency", String(3), nullable=False),
    Column("reference", String(255), nullable=False),
    Column("note", Text, nullable=False),
    Column("at", Utc, nullable=False),
    UniqueConstraint("study_id", "key", "attempt", "event"),
    **OPTIONS,
)

audit = Table(
    "audit",
    metadata,
    _id(),
    _of("study", index=True),
    Column("at", Utc, nullable=False),
    Column("who", String(NAME), nullable=False),
    Column("action", String(NAME), nullable=False),
    Column("details", Json, nullable=False),
    **OPTIONS,
)

researcher = Table(
    "researcher",
    metadata,
    _id(),
    Column("name", String(NAME), nullable=False, unique=True),
    Column("password", String(255), nullable=False),
    Column("role", String(20), nullable=False),
    Column("created", Utc, nullable=False),
    Column("disabled", Boolean, nullable=False),
    **OPTIONS,
)

login = Table(
    "login",
    metadata,
    _id(),
    _of("researcher", index=True),
    Column("token_hash", String(HASH), nullable=False, unique=True),
    Column("created", Utc, nullable=False),
    Column("expires", Utc, nullable=False),
    Column("revoked", Utc),
    **OPTIONS,
)
