"""Several hosts with one database: a visit belongs to one of them at a time."""

import asyncio

import pytest
from store_clock import at

from experiments.errors import StoreError
from experiments.visit.store.hosts import SILENT
from experiments.visit.store.values import utc_now

pytestmark = pytest.mark.anyio


async def test_one_of_two_hosts_that_ask_at_once_gets_a_new_visit(store, arrive):
    for number in range(20):
        person = await arrive(number)
        names = ("one", "two")
        got = await asyncio.gather(*(store.claim(person.id, name, new=True, journal=False) for name in names))
        assert sorted(got) == [False, True]
        assert (await store.person(person.id)).host == names[got.index(True)]
        assert await store.claim(person.id, names[got.index(True)], new=False, journal=False)


async def test_a_host_that_takes_no_new_visits_keeps_those_it_has(store, arrive):
    first, second = await arrive(1), await arrive(2)
    assert await store.greet("one")
    assert await store.claim(first.id, "one", new=True, journal=False)
    await store.drain("one", True, "ada")
    new = await store.greet("one")
    assert not new
    assert await store.claim(first.id, "one", new=new, journal=True)
    assert not await store.claim(second.id, "one", new=new, journal=False)
    await store.drain("one", False, "ada")
    assert await store.greet("one")
    with pytest.raises(StoreError, match="no host 'three'"):
        await store.drain("three", True, "ada")


async def test_visits_of_a_host_that_is_gone_go_to_who_has_the_journal(store, arrive):
    person = await arrive(1)
    await store.greet("one")
    await store.claim(person.id, "one", new=True, journal=False)
    with pytest.raises(StoreError, match="may be running"):
        await store.hand_over("one", "ada")
    assert not await store.claim(person.id, "two", new=True, journal=True), "it may be running"
    with at(utc_now() + SILENT):
        assert await store.hand_over("one", "ada") == 1
    assert await store.hosts() == ()
    assert not await store.claim(person.id, "two", new=True, journal=False)
    assert await store.claim(person.id, "two", new=True, journal=True)
    assert not await store.claim(person.id, "one", new=True, journal=True), "it has an old copy"
    assert [entry.action for entry in await store.audit_log()] == ["host handed over"]
