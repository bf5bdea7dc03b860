"""Backups, restoring and deleting: all is there, or nothing is left."""

import asyncio
import sqlite3
from datetime import timedelta

import numpy as np
import pytest
from sqlalchemy import select

from experiments.errors import StoreError
from experiments.visit.store import CellQuota, Store, copies, restore
from experiments.visit.store.copies import one_file
from experiments.visit.store.engine import Database
from experiments.visit.store.tables import metadata
from experiments.visit.store.upgrade import upgrade

pytestmark = pytest.mark.anyio

SECRET = "5f3c9a61e0platform"


@pytest.fixture
async def played(store):
    """A study with something in every table; the person."""
    person = await store.arrive("prolific", "f" * 64, {"participant": SECRET}, "a" * 64, "consent")
    await store.assign(person.id, [CellQuota(2, (7,))], "balanced", np.random.default_rng(0))
    await store.show_phase(person.id, "consent")
    await store.save_answers(person.id, "consent", {"free text": f"I am {SECRET}"})
    await store.finish_phase(person.id, "consent", "task", {"age": 30})
    await store.finish_trial(person.id, "task", f"visits/{'a' * 64}/task", "finished")
    await store.ledger.decide(person.id, "reward", 750, "USD", f"reward-{SECRET}", "finished")
    await store.ledger.confirm(f"reward-{SECRET}", 1, SECRET)
    ada = await store.researchers.add("ada", "correct horse", "owner")
    await store.researchers.log_in(ada.id, "b" * 64, person.created)
    await store.set_quota(0, 3, "ada")
    await store.greet("first")
    return person


async def everything(store):
    async with store._database.reading() as connection:
        return {
            table.name: [tuple(row) for row in await connection.execute(select(table).order_by(table.c.id))]
            for table in metadata.sorted_tables
        }


@pytest.mark.usefixtures("played")
async def test_a_backup_restored_elsewhere_is_the_same_study(store, tmp_path, other_url):
    await store.backup(tmp_path / "backup.db")
    assert sorted(path.name for path in tmp_path.glob("backup*")) == ["backup.db"]
    await restore(tmp_path / "backup.db", other_url)
    restored = await Store.open(other_url, "pilot", "0" * 64)
    try:
        before = await everything(store)
        assert all(before.values())
        assert await everything(restored) == before
        await restored.arrive("link", None, {}, "c" * 64, "consent")
        with pytest.raises(StoreError, match="not empty"):
            await restore(tmp_path / "backup.db", other_url)
    finally:
        await restored.close()


async def test_a_backup_is_of_one_moment_while_people_go_on(store, tmp_path, arrive):
    stop = asyncio.Event()

    async def crowd():
        number = 0
        while not stop.is_set():
            number += 1
            await arrive(number)

    running = asyncio.create_task(crowd())
    for number in range(3):
        await asyncio.sleep(0.05)
        await store.backup(tmp_path / f"{number}.db")
    stop.set()
    await running
    for number in range(3):
        with sqlite3.connect(tmp_path / f"{number}.db") as copy:
            people = {row[0] for row in copy.execute("SELECT id FROM person")}
            assert people
            assert people == {row[0] for row in copy.execute("SELECT person_id FROM identity")}


async def test_a_backup_overwrites_nothing_and_a_damaged_one_is_refused(store, tmp_path, arrive, other_url):
    for number in range(200):
        await arrive(number)
    backup = tmp_path / "backup.db"
    await store.backup(backup)
    with pytest.raises(StoreError, match="there already"):
        await store.backup(backup)
    content = bytearray(backup.read_bytes())
    content[len(content) // 2 :] = bytes(len(content) - len(content) // 2)
    backup.write_bytes(content)
    with pytest.raises(StoreError, match="damaged"):
        await restore(backup, other_url)
    with pytest.raises(StoreError, match="no backup"):
        await restore(tmp_path / "none.db", other_url)


async def test_who_is_erased_leaves_nothing_but_what_was_paid(store, played, arrive, url):
    other = await arrive(5)
    await store.erase(played.id, "ada")
    left = await everything(store)
    assert SECRET not in repr(left)
    assert {name for name, rows in left.items() if rows} == {
        "study",
        "person",
        "identity",
        "audit",
        "researcher",
        "login",
        "host",
    }
    assert await store.find("a" * 64) is None
    assert [person.id for person in await store.people()] == [other.id]
    paid = {"kind": "reward", "cents": 750, "currency": "USD"}
    assert (await store.audit_log())[-1].details == {"person": played.id, "paid": [paid]}
    if url.startswith("sqlite"):
        file = url.removeprefix("sqlite:///")
        for name in (file, f"{file}-wal"):
            with open(name, "rb") as content:  # noqa: PTH123
                assert SECRET.encode() not in content.read()
    with pytest.raises(StoreError, match=f"no person {played.id}"):
        await store.erase(played.id, "ada")


async def test_who_is_forgotten_keeps_what_they_did_and_nothing_that_tells_who_they_are(
    store, played, arrive
):
    other = await arrive(5)
    await store.save_answers(played.id, "task", {"later": 1})
    assert await store.known(other.seen + timedelta(days=1)) == (played.id, other.id)
    assert await store.known(other.seen - timedelta(days=1)) == ()
    before = await store.answers(played.id)
    await store.forget([played.id], ["c" * 64], "keep_days")
    assert await store.known(other.seen + timedelta(days=1)) == (other.id,)
    assert await store.find("a" * 64) is None
    assert (await store.person(played.id)).token_hash == "c" * 64
    assert [row.folder for row in await store.trials()] == [f"visits/{'c' * 64}/task"]
    assert await store.answers(played.id) == before
    left = await everything(store)
    for name in ("person", "identity", "trial"):
        assert SECRET not in repr(left[name]) and "f" * 64 not in repr(left[name])
    assert [event.reference for event in await store.ledger.history(played.id)] == ["", ""]
    assert [event.cents for event in await store.ledger.history(played.id)] == [750, 750]
    again = await store.arrive("prolific", "f" * 64, {"participant": SECRET}, "d" * 64, "consent")
    assert again.id not in (played.id, other.id) and not again.returning


async def test_participants_of_another_study_in_the_same_database_are_not_erased_or_forgotten(
    store, with_tables, arrive
):
    person = await arrive()
    other = await Store.open(with_tables, "another", "0" * 64)
    try:
        assert await other.known(person.seen + timedelta(days=1)) == ()
        await other.forget([person.id], ["c" * 64], "keep_days")
        with pytest.raises(StoreError, match=f"no person {person.id}"):
            await other.erase(person.id, "ada")
    finally:
        await other.close()
    assert await store.person(person.id) == person
    assert await store.identity(person.id) == {"participant": "p1"}


async def test_nobody_is_erased_who_is_owed_something(store, arrive):
    person = await arrive()
    await store.ledger.decide(person.id, "reward", 750, "USD", "r")
    with pytest.raises(StoreError, match="owed r: pay first"):
        await store.erase(person.id, "ada")
    assert await store.person(person.id)


async def test_of_two_backups_to_one_file_one_succeeds_and_one_is_refused(
    store, tmp_path, arrive, monkeypatch
):
    """The second begins and ends while the first is under way."""
    await arrive(1)
    folder, copy = tmp_path / "backups", copies._copy
    folder.mkdir()

    async def overtaken(source, target):
        monkeypatch.setattr(copies, "_copy", copy)
        await store.backup(folder / "b.db")
        await arrive(2)
        await copy(source, target)

    monkeypatch.setattr(copies, "_copy", overtaken)
    with pytest.raises(StoreError, match=r"b.db is there already: name a new file for the backup"):
        await store.backup(folder / "b.db")
    assert [path.name for path in folder.iterdir()] == ["b.db"]
    with sqlite3.connect(folder / "b.db") as made:
        assert made.execute("SELECT count(*) FROM person").fetchone() == (1,)


@pytest.mark.parametrize("step", ["upgrade", "_copy", "one_file"])
async def test_a_backup_for_which_the_disk_is_too_small_leaves_nothing(store, tmp_path, step, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    folder = tmp_path / "backups"
    folder.mkdir()
    monkeypatch.setattr(copies, step, full)
    with pytest.raises(OSError, match="No space"):
        await store.backup(folder / "b.db")
    assert not list(folder.iterdir())


async def test_only_the_backup_of_a_study_is_restored(tmp_path):
    empty, foreign, tables = (tmp_path / name for name in ("empty.db", "foreign.db", "tables.db"))
    empty.touch()
    with sqlite3.connect(foreign) as database:
        database.execute("CREATE TABLE notes (id INTEGER)")
    await upgrade(database := Database(f"sqlite:///{tables}"))
    await database.close()
    one_file(tables)
    for path, why in (
        (empty, "not the database of a study"),
        (foreign, "another program"),
        (tables, "no study"),
    ):
        with pytest.raises(StoreError, match=f"{path.name}.*{why}"):
            await restore(path, f"sqlite:///{tmp_path / 'new.db'}")
    assert not (tmp_path / "new.db").exists()


async def test_a_study_is_only_added_where_that_is_wanted(tmp_path):
    url = f"sqlite:///{tmp_path / 'study.db'}"
    with pytest.raises(StoreError, match="There is no database"):
        await Store.open(url, "pilot", "0" * 64, create=False)
    assert not (tmp_path / "study.db").exists()
    await (await Store.open(url, "pilot", "0" * 64, alone=True)).close()
    for refused in ({"create": False}, {"alone": True}):
        with pytest.raises(StoreError, match=r"no study 'other'.*it has: pilot"):
            await Store.open(url, "other", "0" * 64, **refused)
    await (await Store.open(url, "pilot", "0" * 64, create=False)).close()
    await (await Store.open(url, "other", "0" * 64)).close()  # a database may hold several studies
