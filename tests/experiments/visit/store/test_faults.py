"""Faults: a killed database server, requests that are given up, a lock that another program holds."""

import asyncio
import sqlite3

import numpy as np
import pytest
from sqlalchemy import make_url

from experiments.errors import StoreError
from experiments.visit.store import CellQuota, Store, engine

pytestmark = pytest.mark.anyio


@pytest.mark.slow
async def test_a_server_that_is_killed_loses_nothing_and_the_store_goes_on(url, request):
    kind = {"mysql": "mariadb", "postgresql": "postgresql"}.get(make_url(url).get_backend_name())
    if kind is None:
        pytest.skip("SQLite has no server")
    server = request.getfixturevalue(kind)
    store = await Store.open(url, "pilot", "0" * 64)
    acknowledged, failed = set(), []

    async def person(number):
        try:
            arrived = await store.arrive("link", f"{number:064x}", {}, f"{number:064x}", "consent")
            await store.finish_phase(arrived.id, "consent", "story", {"number": number})
            acknowledged.add(number)
        except StoreError as error:
            failed.append(str(error))

    try:
        for round_ in range(3):
            numbers = range(100 * round_, 100 * round_ + 100)
            waiting = [asyncio.create_task(person(number)) for number in numbers]
            while len(acknowledged) < 50 + 100 * round_ and not all(task.done() for task in waiting):
                await asyncio.sleep(0.005)
            server.kill()
            await asyncio.to_thread(server.start)
            await asyncio.gather(*waiting)
            await asyncio.gather(*(person(number) for number in numbers if number not in acknowledged))
        answers = sorted(answer.value for answer in await store.answers() if answer.final)
        assert len(acknowledged) > 200
        assert set(answers) >= acknowledged
        assert len(answers) == len(set(answers))
        assert all("cannot be reached" in message for message in failed), set(failed)
    finally:
        await store.close()


async def test_requests_that_are_given_up_leave_nothing_half_done(store):
    rng = np.random.default_rng(0)

    async def person(number):
        arrived = await store.arrive("link", None, {"participant": "p"}, f"{number:064x}", "consent")
        await store.assign(arrived.id, [CellQuota(100, (1,))], "uniform", rng)
        await store.finish_phase(arrived.id, "consent", "story", {"a": 1, "b": 2})
        return arrived.id

    tasks = [asyncio.create_task(person(number)) for number in range(60)]
    for task in tasks[::2]:
        await asyncio.sleep(0.003)
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    finished = {task.result() for task in tasks if not task.cancelled()}
    people = await store.people()
    assert {person.id for person in people if person.phase == "story"} >= finished
    for one in people:
        assert await store.identity(one.id) == {"participant": "p"}
        assert len(await store.answers(one.id)) == (2 if one.phase == "story" else 0)
    assert len(await asyncio.gather(*(person(number) for number in range(100, 110)))) == 10


async def test_a_database_that_another_program_locks_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr(engine, "PATIENCE_S", 0.2)
    store = await Store.open(f"sqlite:///{tmp_path}/study.db", "pilot", "0" * 64)
    try:
        with sqlite3.connect(tmp_path / "study.db") as other:
            other.execute("BEGIN IMMEDIATE")
            with pytest.raises(StoreError, match="locked by another program"):
                await store.arrive("link", None, {}, "a" * 64, "consent")
            assert await store.people() == ()
            other.rollback()
        assert await store.arrive("link", None, {}, "a" * 64, "consent")
    finally:
        await store.close()
