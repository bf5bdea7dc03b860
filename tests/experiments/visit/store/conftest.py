"""Each test of the store runs on SQLite, and as a slow test on MariaDB and PostgreSQL."""

import asyncio
import uuid
from pathlib import Path

import pytest
from database_servers import SERVERS, MissingProgramError
from sqlalchemy import make_url, text
from sqlalchemy.ext.asyncio import create_async_engine
from store_clock import at
from study_database import new_database

from experiments.visit.store import Store
from experiments.visit.store.engine import DRIVERS

HASH = "0" * 64
URLS = {"mariadb": "mysql:", "postgresql": "postgresql:"}


@pytest.fixture
def anyio_backend():
    return "asyncio"


def _server(kind):
    try:
        with SERVERS[kind]() as server:
            yield server
    except MissingProgramError as reason:
        pytest.skip(str(reason))


@pytest.fixture(scope="session")
def mariadb():
    yield from _server("mariadb")


@pytest.fixture(scope="session")
def postgresql():
    yield from _server("postgresql")


@pytest.fixture(
    params=["sqlite", *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("mariadb", "postgresql"))]
)
def url(request, tmp_path):
    """URL of an empty database."""
    return _new_database(request, tmp_path / "study.db")


@pytest.fixture
def other_url(request, tmp_path, url):
    """URL of another empty database, on the same server."""
    request.param = next((kind for kind in SERVERS if url.startswith(URLS[kind])), "sqlite")
    return _new_database(request, tmp_path / "other.db")


def _new_database(request, file):
    if request.param == "sqlite":
        return f"sqlite:///{file}"
    server = request.getfixturevalue(request.param).url
    name = f"study_{uuid.uuid4().hex}"
    asyncio.run(_create(server, name))
    return f"{server}/{name}"


async def _create(server, name):
    kind = make_url(server).get_backend_name()
    home = make_url(server).set(
        drivername=DRIVERS[kind], database="postgres" if kind == "postgresql" else None
    )
    engine = create_async_engine(home, isolation_level="AUTOCOMMIT")
    async with engine.connect() as connection:
        await connection.execute(text(f"CREATE DATABASE {name}"))
    await engine.dispose()


@pytest.fixture
def with_tables(url):
    return new_database(Path(make_url(url).database)) if url.startswith("sqlite:") else url


@pytest.fixture
async def store(with_tables):
    """An open store, in which hashing a password takes little memory and so little time."""
    opened = await Store.open(with_tables, "pilot", HASH, password_memory_kib=64)
    yield opened
    await opened.close()


@pytest.fixture
def arrive(store):
    """Lets somebody arrive, by number."""

    async def somebody(number=1, key=None, now=None, phase="consent"):
        with at(now):
            return await store.arrive("link", key, {"participant": f"p{number}"}, f"{number:064x}", phase)

    return somebody
