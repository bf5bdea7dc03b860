"""Migrate a database to the current schema. A lock prevents two processes from migrating it at once."""

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, inspect, text
from sqlalchemy.ext.asyncio import AsyncConnection

from experiments.errors import StoreError
from experiments.visit.store.engine import PATIENCE_S, Database
from experiments.visit.store.tables import metadata

MIGRATIONS = Path(__file__).parent / "migrations"
VERSIONS = "alembic_version"
LOCK = 7_303_014  # arbitrary number that identifies the lock for upgrades


async def upgrade(database: Database, migrations: Path = MIGRATIONS, *, create: bool = True) -> None:
    """Create the tables, or migrate existing tables and their rows to the current schema.

    Raises StoreError if the tables are from a newer version of mjsim or from another program, or if there are no
    tables and `create` is false.
    """
    if not create and database.kind == "sqlite" and not Path(database.url.database or "").is_file():
        raise StoreError(f"There is no database {database.name}: name the one of `mjsim study serve`.")

    async def work(connection: AsyncConnection) -> None:
        await _lock(connection, database.kind)
        try:
            await connection.run_sync(_upgrade, migrations, database.name, create)
        finally:
            if database.kind == "mysql":
                await connection.execute(text("DO RELEASE_LOCK(:name)"), {"name": f"mjsim{LOCK}"})

    await database.write(work)


async def _lock(connection: AsyncConnection, kind: str) -> None:
    if kind == "mysql":
        found = await connection.execute(
            text("SELECT GET_LOCK(:name, :wait)"), {"name": f"mjsim{LOCK}", "wait": PATIENCE_S}
        )
        if found.scalar() != 1:
            raise StoreError(
                "Another process has been upgrading the database for long: try again when it is done."
            )
    elif kind == "postgresql":
        await connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": LOCK})


def _upgrade(connection: Connection, migrations: Path, name: str, create: bool) -> None:
    config = Config()
    config.set_main_option("script_location", str(migrations).replace("%", "%%"))
    config.attributes["connection"] = connection
    script = ScriptDirectory.from_config(config)
    current = MigrationContext.configure(connection).get_current_revision()
    if current is not None and current not in {step.revision for step in script.walk_revisions()}:
        raise StoreError(
            f"The database {name} was made by a newer mjsim (its form is {current!r}): install that version."
        )
    tables, sqlite = set(inspect(connection).get_table_names()), connection.dialect.name == "sqlite"
    # A database server may be shared with other programs, but a SQLite file may not.
    if VERSIONS not in tables and (tables if sqlite else tables & set(metadata.tables)):
        raise StoreError(
            f"The database {name} holds tables of another program: give the study one of its own."
        )
    if current is None and not create:
        raise StoreError(f"{name} is not the database of a study: name the one of `mjsim study serve`.")
    if current != script.get_current_head():
        command.upgrade(config, "head")
