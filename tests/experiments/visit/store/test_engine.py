"""The database itself: what is acknowledged is on the disk, upgrades keep data, and errors say what to do."""

import asyncio
import shutil
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from sqlalchemy import text

from experiments.errors import StoreError
from experiments.visit.store import Store, engine
from experiments.visit.store.engine import Database
from experiments.visit.store.tables import metadata
from experiments.visit.store.upgrade import MIGRATIONS, upgrade

pytestmark = pytest.mark.anyio

LATER = '''
"""A later form, with one more column."""

import sqlalchemy as sa
from alembic import op

revision = "later"
down_revision = "0002"


def upgrade() -> None:
    op.add_column("person", sa.Column("place", sa.String(100), nullable=False, server_default="here"))
'''

# Twenty people at a time come, get a place, answer and are paid; a line is printed for what has been acknowledged.
ACKNOWLEDGE = """
import asyncio, sys
import numpy as np
from experiments.visit.store import CellQuota, Store

async def one(store, number, rng):
    person = await store.arrive("link", f"{number:064x}", {"id": "p"}, f"{number:064x}", "consent")
    print("person", person.id, flush=True)
    place = await store.assign(person.id, [CellQuota(1000, (1, 2, 3))] * 3, "balanced", rng)
    print("place", person.id, place.cell, place.place, flush=True)
    await store.save_answers(person.id, "consent", {"number": number})
    print("answer", person.id, number, flush=True)
    await store.finish_phase(person.id, "consent", "completion", {"last": number}, status="finished")
    print("finished", person.id, flush=True)
    await store.ledger.decide(person.id, "reward", 750, "USD", f"reward-{number}")
    print("owed", person.id, await store.ledger.begin_sending(f"reward-{number}"), flush=True)

async def many(store, first):
    rng = np.random.default_rng(first)
    number = first
    while True:
        await one(store, number, rng)
        number += 20

async def main():
    store = await Store.open(sys.argv[1], "pilot", "0" * 64)
    await asyncio.gather(*(many(store, first) for first in range(20)))

asyncio.run(main())
"""


async def run(store, sql, **values):
    async def work(connection):
        await connection.execute(text(sql), values)

    await store._database.write(work)


@pytest.mark.parametrize("lines", [101, *(pytest.param(n, marks=pytest.mark.slow) for n in (30, 250))])
async def test_what_is_acknowledged_survives_a_kill(url, lines):
    command = [sys.executable, "-c", ACKNOWLEDGE, url]
    acknowledged = []
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout:
            if not line.endswith("\n"):
                break
            what, *numbers = line.split()
            acknowledged.append((what, *map(int, numbers)))
            if len(acknowledged) == lines:
                process.kill()
    store = await Store.open(url, "pilot", "0" * 64)
    try:
        kept = await _kept(store)
        assert len(acknowledged) >= lines
        assert [line for line in acknowledged if line not in kept] == []
        for person in await store.people():
            finished = person.status == "finished"
            assert (person.phase == "completion") == finished
            assert (("finished_place", person.id) in kept) == finished
            assert await store.identity(person.id) == {"id": "p"}
    finally:
        await store.close()


async def _kept(store):
    """What is in the store, in the words of `ACKNOWLEDGE`."""
    people, places = await store.people(), await store.assignments()
    return {
        *(("person", person.id) for person in people),
        *(("place", place.person_id, place.cell, place.place) for place in places),
        *(("answer", a.person_id, a.value) for a in await store.answers() if a.item == "number"),
        *(("finished", a.person_id) for a in await store.answers() if a.item == "last" and a.final),
        *(("finished_place", place.person_id) for place in places if place.state == "finished"),
        *(
            ("owed", event.person_id, event.attempt)
            for event in await store.ledger.history()
            if event.in_doubt
        ),
    }


async def test_the_migrations_make_the_tables(store):
    async with store._database.reading() as connection:
        difference = await connection.run_sync(
            lambda sync: compare_metadata(
                MigrationContext.configure(sync, opts={"compare_type": True}), metadata
            )
        )
    assert difference == []


async def test_a_later_form_keeps_what_is_there_and_an_older_program_refuses_it(url, store, arrive, tmp_path):
    people = [await arrive(number) for number in range(3)]
    await store.save_answers(people[0].id, "consent", {"age": 30})
    later = shutil.copytree(MIGRATIONS, tmp_path / "migrations")
    (later / "versions" / "0003_later.py").write_text(LATER)
    await upgrade(store._database, later)
    await upgrade(store._database, later)
    assert [person.token_hash for person in await store.people()] == [person.token_hash for person in people]
    assert len(await store.answers()) == 1
    async with store._database.reading() as connection:
        assert (await connection.execute(text("SELECT place FROM person"))).scalars().all() == ["here"] * 3
    with pytest.raises(StoreError, match="newer mjsim"):
        await Store.open(url, "pilot", "0" * 64)


async def test_an_upgrade_that_was_interrupted_goes_on(url):
    """MariaDB commits each table by itself."""
    store = await Store.open(url, "pilot", "0" * 64)
    await run(store, "DROP TABLE login")
    await run(store, "DELETE FROM alembic_version")
    await store.close()
    store = await Store.open(url, "pilot", "0" * 64)
    assert await store.researchers.who("a" * 64) is None
    await store.close()


async def test_a_database_with_a_column_that_is_no_longer_used_keeps_working(url, store, arrive):
    """The column `phase.attempts` was never written."""
    await run(store, "ALTER TABLE phase ADD COLUMN attempts INTEGER")
    person = await arrive(0)
    again = await Store.open(url, "pilot", "0" * 64)
    try:
        await again.show_phase(person.id, "consent")
        await again.finish_phase(person.id, "consent", "task", {})
        assert [(row.name, row.ended is not None) for row in await again.phases()] == [("consent", True)]
    finally:
        await again.close()


def test_a_new_sqlite_file_is_opened_by_several_at_once(tmp_path):
    """SQLite refuses at once, whatever the timeout, if two connections switch a file to WAL mode together."""

    async def use(url):
        database = Database(url)
        together.wait()
        await database.check()
        await database.close()

    together = threading.Barrier(4)
    with ThreadPoolExecutor(4) as pool:
        for number in range(40):
            url = f"sqlite:///{tmp_path / f'{number}.db'}"
            list(pool.map(lambda url: asyncio.run(use(url)), [url] * 4))


async def test_two_processes_that_start_at_once_make_one_study(url):
    stores = await asyncio.gather(*(Store.open(url, "pilot", "0" * 64) for _ in range(4)))
    assert len({(await store.study()).id for store in stores}) == 1
    for store in stores:
        await store.close()


async def test_a_changed_study_file_is_noted(store, url):
    again = await Store.open(url, "pilot", "1" * 64)
    await again.close()
    [entry] = await store.audit_log()
    assert (entry.action, entry.details) == ("study file changed", {"before": "0" * 64, "now": "1" * 64})
    assert (await store.study()).file_hash == "1" * 64


async def test_a_database_holds_several_studies(store, url, arrive):
    person = await arrive(1, key="a" * 64)
    other = await Store.open(url, "second", "0" * 64)
    try:
        assert await other.people() == ()
        assert not (await other.arrive("link", "a" * 64, {}, f"{2:064x}", "consent")).returning
        assert await other.find(person.token_hash) is None
        assert len(await store.people()) == 1
    finally:
        await other.close()


async def test_the_state_of_a_study_and_who_changed_it(store):
    assert (await store.study()).state == "open"
    await store.set_state("paused", "ada")
    await store.audit("ada", "looked at a session", {"person": 3})
    assert (await store.study()).state == "paused"
    assert [(entry.who, entry.action) for entry in await store.audit_log()] == [
        ("ada", "study paused"),
        ("ada", "looked at a session"),
    ]


async def test_tables_of_another_program_are_left_alone(url):
    database = Database(url)

    async def work(connection):
        await connection.execute(text("CREATE TABLE person (id INTEGER)"))

    await database.write(work)
    await database.close()
    with pytest.raises(StoreError, match="another program"):
        await Store.open(url, "pilot", "0" * 64)


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("oracle://here", "'oracle://here' is not a database URL"),
        ("study.db", "is not a database URL. Use sqlite:///FILE, mysql://USER:PASSWORD@HOST/NAME"),
        ("me:secret@here/study", "'text without ://' is not a database URL"),
        ("postgresql://me:se@secret@127.0.0.1:9/study", "contains @: write %40 instead"),
        ("postgresql://me:secret@[::1/study", r"me:\*\*\*@\[::1/study' is not a database URL"),
        ("mysql://me:secret@here:many/study", "is not a database URL"),
        ("sqlite://", "name a file"),
        ("sqlite:////nowhere/at/all/study.db", "make it first"),
        ("postgresql://me:secret@127.0.0.1:9/study", "cannot be reached"),
        ("mysql://me:secret@127.0.0.1:9/study", "cannot be reached"),
    ],
)
async def test_errors_say_what_to_do_and_no_password(url, message, monkeypatch):
    monkeypatch.setattr(engine, "PAUSE_S", 0.0)
    with pytest.raises(StoreError, match=message) as caught:
        await Store.open(url, "pilot", "0" * 64)
    assert "secret" not in str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "address", "message"),
    [
        ("mariadb", "mysql://study:wrong@{}/none", "refuses this user"),
        ("mariadb", "mysql://study:secret@{}/none", "does not exist"),
        ("postgresql", "postgresql://nobody@{}/none", "refuses this user"),
        ("postgresql", "postgresql://study@{}/none", "does not exist"),
    ],
)
async def test_a_wrong_user_or_database_is_named(request, kind, address, message):
    server = request.getfixturevalue(kind).url.rpartition("@")[2]
    with pytest.raises(StoreError, match=message):
        await Store.open(address.format(server), "pilot", "0" * 64)


@pytest.mark.parametrize(
    ("kind", "unsafe", "safe"),
    [
        (
            "mysql",
            "SET GLOBAL innodb_flush_log_at_trx_commit = 2",
            "SET GLOBAL innodb_flush_log_at_trx_commit = 1",
        ),
        ("postgresql", "ALTER DATABASE {} SET synchronous_commit = off", "ALTER DATABASE {} RESET ALL"),
    ],
)
async def test_a_server_that_may_lose_what_it_confirmed_is_refused(url, store, kind, unsafe, safe):
    database = store._database.url
    if database.get_backend_name() != kind:
        pytest.skip(f"only for {kind}")
    await run(store, unsafe.format(database.database))
    try:
        with pytest.raises(StoreError, match=r"may lose what it has confirmed.* set it to (1|on)\."):
            await Store.open(url, "pilot", "0" * 64)
    finally:
        await run(store, safe.format(database.database))


async def test_a_damaged_file_is_named(tmp_path):
    (tmp_path / "study.db").write_bytes(b"no database at all, but long enough" * 100)
    with pytest.raises(StoreError, match="damaged: restore"):
        await Store.open(f"sqlite:///{tmp_path}/study.db", "pilot", "0" * 64)


async def test_a_full_disk_is_named_and_takes_nothing_back(tmp_path):
    store = await Store.open(f"sqlite:///{tmp_path}/study.db", "pilot", "0" * 64)
    try:
        person = await store.arrive("link", None, {}, "a" * 64, "consent")
        await store.save_answers(person.id, "consent", {"kept": 1})
        async with store._database.reading() as connection:
            pages = (await connection.execute(text("PRAGMA page_count"))).scalar()
        await run(store, f"PRAGMA max_page_count = {pages}")
        with pytest.raises(StoreError, match="no space left"):
            await store.save_answers(person.id, "consent", {"lost": "x" * 1_000_000})
        assert [answer.item for answer in await store.answers()] == ["kept"]
    finally:
        await store.close()
    assert Path(tmp_path / "study.db").is_file()


async def test_a_change_that_fails_takes_no_other_along(store, arrive):
    """Changes that wait for the same commit are as safe as alone."""
    first = await arrive(0)
    await store.withdraw(first.id, delete=False)

    async def change(number):
        if number % 7 == 3:
            await store.ledger.decide(first.id, "reward", -1, "USD", f"key-{number}")  # the table takes none
        else:
            await arrive(number + 1)

    results = await asyncio.gather(*(change(number) for number in range(50)), return_exceptions=True)
    failed = {number for number, result in enumerate(results) if result is not None}
    assert failed == {number for number in range(50) if number % 7 == 3}
    assert all(isinstance(results[number], StoreError) for number in failed)
    assert len(await store.people()) == 1 + 50 - len(failed)
