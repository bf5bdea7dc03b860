"""Create the first version of all tables.

MariaDB commits each table separately, so an interrupted upgrade may have created some of them.
"""

from typing import Any

import sqlalchemy as sa
from alembic import op
from sqlalchemy.dialects import mysql

revision = "0001"
down_revision = None

TIME = sa.DateTime().with_variant(mysql.DATETIME(fsp=6), "mysql")
JSON = sa.Text().with_variant(mysql.MEDIUMTEXT(), "mysql")


def upgrade() -> None:
    _studies_and_people()
    _progress()
    _money_and_researchers()


def _table(name: str, *parts: Any) -> None:
    op.create_table(
        name,
        sa.Column("id", sa.Integer, nullable=False),
        sa.PrimaryKeyConstraint("id", name=op.f(f"pk_{name}")),
        *parts,
        if_not_exists=True,
        sqlite_autoincrement=True,
        mysql_engine="InnoDB",
        mysql_charset="utf8mb4",
        mysql_collate="utf8mb4_bin",
    )


def _text(name: str, length: int, *, null: bool = False) -> sa.Column[Any]:
    return sa.Column(name, sa.String(length), nullable=null)


def _column(name: str, kind: Any, *, null: bool = False) -> sa.Column[Any]:
    return sa.Column(name, kind, nullable=null)


def _refers(table: str, to: str) -> tuple[Any, Any]:
    column = f"{to}_id"
    return (
        sa.Column(column, sa.Integer, nullable=False),
        sa.ForeignKeyConstraint([column], [f"{to}.id"], name=op.f(f"fk_{table}_{column}")),
    )


def _unique(table: str, *columns: str) -> sa.UniqueConstraint:
    return sa.UniqueConstraint(*columns, name=op.f(f"uq_{table}_{'_'.join(columns)}"))


def _index(table: str, column: str) -> None:
    op.create_index(op.f(f"ix_{table}_{column}"), table, [column], if_not_exists=True)


def _studies_and_people() -> None:
    _table(
        "study",
        _text("name", 100),
        _text("file_hash", 64),
        _text("state", 20),
        _column("created", TIME),
        _column("quotas", JSON),
        _unique("study", "name"),
    )
    _table(
        "person",
        *_refers("person", "study"),
        _text("token_hash", 64),
        _text("platform", 20),
        _text("platform_key", 64, null=True),
        _text("status", 20),
        _text("phase", 100),
        _column("created", TIME),
        _column("seen", TIME),
        _column("delete_wanted", sa.Boolean),
        _unique("person", "token_hash"),
        _unique("person", "study_id", "platform_key"),
    )
    _table("identity", *_refers("identity", "person"), _column("ids", JSON), _unique("identity", "person_id"))
    _table(
        "assignment",
        *_refers("assignment", "person"),
        *_refers("assignment", "study"),
        _column("cell", sa.Integer),
        _column("place", sa.Integer),
        _column("active", sa.SmallInteger, null=True),
        _text("state", 20),
        _column("house_seed", sa.BigInteger),
        _column("person_seed", sa.BigInteger),
        _column("order_seed", sa.BigInteger),
        _column("created", TIME),
        _unique("assignment", "person_id"),
        _unique("assignment", "study_id", "cell", "place", "active"),
    )


def _progress() -> None:
    _table(
        "phase",
        *_refers("phase", "person"),
        _text("name", 100),
        _column("shown", TIME),
        _column("ended", TIME, null=True),
        _column("duration_s", sa.Double, null=True),
        _column("attempts", sa.Integer, null=True),
        _text("reason", 100, null=True),
        _unique("phase", "person_id", "name"),
    )
    _table(
        "answer",
        *_refers("answer", "person"),
        _text("phase", 100),
        _text("item", 100),
        _column("value", JSON),
        _column("given", TIME),
        _column("final", sa.Boolean),
        _unique("answer", "person_id", "phase", "item"),
    )
    _table(
        "trial",
        *_refers("trial", "person"),
        _text("phase", 100),
        _text("folder", 255),
        _text("ended", 100),
        _column("finished", TIME),
        _unique("trial", "person_id", "phase"),
    )


def _money_and_researchers() -> None:
    _table(
        "payment",
        *_refers("payment", "study"),
        *_refers("payment", "person"),
        _text("key", 100),
        _column("attempt", sa.Integer),
        _text("event", 20),
        _text("kind", 20),
        _column("cents", sa.Integer),
        _text("currency", 3),
        _text("reference", 255),
        _column("note", sa.Text),
        _column("at", TIME),
        _unique("payment", "study_id", "key", "attempt", "event"),
    )
    _index("payment", "person_id")
    _table(
        "audit",
        *_refers("audit", "study"),
        _column("at", TIME),
        _text("who", 100),
        _text("action", 100),
        _column("details", JSON),
    )
    _index("audit", "study_id")
    _table(
        "researcher",
        _text("name", 100),
        _text("password", 255),
        _text("role", 20),
        _column("created", TIME),
        _column("disabled", sa.Boolean),
        _unique("researcher", "name"),
    )
    _table(
        "login",
        *_refers("login", "researcher"),
        _text("token_hash", 64),
        _column("created", TIME),
        _column("expires", TIME),
        _column("revoked", TIME, null=True),
        _unique("login", "token_hash"),
    )
    _index("login", "researcher_id")
