"""Arrivals: one person a link and a platform's id, however many requests come at once."""

import asyncio
from datetime import UTC, datetime, timedelta

import pytest
from store_clock import at

from experiments.errors import StoreError

pytestmark = pytest.mark.anyio


async def test_a_person_is_found_by_the_link_and_comes_back_as_the_same(store, arrive):
    person = await arrive(1)
    again = await arrive(1)
    assert (again.id, again.returning, person.returning) == (person.id, True, False)
    assert await store.find(person.token_hash) == person
    assert await store.find("f" * 64) is None
    assert person.created.tzinfo is UTC


async def test_the_same_platform_id_is_the_same_person_whatever_the_link(store, arrive):
    first = await arrive(1, key="a" * 64)
    again = await arrive(2, key="a" * 64)
    assert (again.id, again.token_hash) == (first.id, first.token_hash)
    assert await store.identity(first.id) == {"participant": "p2"}, "a task was given back and accepted again"
    await store.finish_phase(first.id, first.phase, first.phase, status="finished")
    await arrive(3, key="a" * 64)
    assert await store.identity(first.id) == {"participant": "p2"}, "that of the submission is paid"


async def test_those_without_a_sign_of_life_time_out(store, arrive):
    early, late = datetime(2026, 5, 1, 12, tzinfo=UTC), datetime(2026, 5, 1, 13, tzinfo=UTC)
    gone, there, finished = await arrive(1, now=early), await arrive(2, now=late), await arrive(3, now=early)
    with at(early):
        await store.finish_phase(finished.id, finished.phase, finished.phase, status="finished")
    assert await store.time_out(late) == 1
    assert await store.time_out(late) == 0
    statuses = [(await store.person(person.id)).status for person in (gone, there, finished)]
    assert statuses == ["timed_out", "arrived", "finished"]


async def test_500_arrivals_at_once_of_250_people_make_250(store, arrive):
    people = await asyncio.gather(*(arrive(number, key=f"{number // 2:064x}") for number in range(500)))
    assert len({person.id for person in people}) == 250
    assert sum(person.returning for person in people) == 250
    assert len(await store.people()) == 250


async def test_keys_that_differ_in_case_alone_are_two_people(arrive):
    assert (await arrive(1, key="Abc")).id != (await arrive(2, key="abc")).id


async def test_a_sign_of_life_never_goes_back_in_time(store, arrive):
    person = await arrive(1, now=datetime(2026, 5, 1, 12, tzinfo=UTC))
    for moment in (person.seen + timedelta(minutes=1), person.seen):
        with at(moment):
            await store.beat(person.id)
    assert (await store.person(person.id)).seen == person.seen + timedelta(minutes=1)


async def test_a_time_without_a_zone_is_refused(store, arrive):
    person = await arrive(1)
    with at(datetime(2026, 5, 1, 12)), pytest.raises(StoreError, match="no time zone"):
        await store.beat(person.id)


async def test_an_unknown_person_is_an_error_that_names_the_number(store):
    with pytest.raises(StoreError, match="no person 7"):
        await store.person(7)


async def test_a_visit_ends_once(store, arrive):
    first, second = await arrive(1), await arrive(2)
    assert await store.finish_phase(second.id, second.phase, second.phase, status="no_consent")
    assert not await store.finish_phase(second.id, second.phase, second.phase, status="finished")
    assert {person.id: person.status for person in await store.people()} == {
        first.id: "arrived",
        second.id: "no_consent",
    }
