"""Places: nobody has one that somebody else has, quotas hold, and abandoned places go to the next person."""

import asyncio
from datetime import timedelta

import numpy as np
import pytest
from store_clock import at

from experiments.errors import StoreError
from experiments.visit.store import CellQuota, Store
from experiments.visit.store.values import CellCount

pytestmark = pytest.mark.anyio

ABANDONED = timedelta(minutes=30)
CELLS = [CellQuota(3, (10, 11, 12)), CellQuota(2, (20,))]


@pytest.fixture
def assign(store):
    async def place(person, cells=CELLS, rule="balanced", now=None, side=None, seed=0):
        rng = np.random.default_rng(seed)
        with at(now):
            return await (side or store).assign(person.id, cells, rule, rng, ABANDONED)

    return place


def places(assignments):
    return sorted((one.cell, one.place) for one in assignments if one is not None)


async def test_a_person_has_one_place_however_often_it_is_asked_for(store, arrive, assign):
    person = await arrive()
    first, *more = await asyncio.gather(*(assign(person, seed=seed) for seed in range(8)))
    assert more == [first] * 7
    assert await store.assignment(person.id) == first
    assert (await store.person(person.id)).status == "assigned"


async def test_each_place_has_its_house_and_each_person_an_order(arrive, assign):
    people = [await arrive(number) for number in range(5)]
    given = [await assign(person, seed=person.id) for person in people]
    houses = {(0, 0): 10, (0, 1): 11, (0, 2): 12, (1, 0): 20, (1, 1): 20}
    assert {(one.cell, one.place): one.house_seed for one in given} == houses
    assert len({one.order_seed for one in given} | {one.person_seed for one in given}) == 10


@pytest.mark.slow
async def test_500_at_once_from_two_connections_get_a_place_of_their_own(store, url, arrive, assign):
    cells = [CellQuota(33, range(33))] * 12  # 396 places
    people = await asyncio.gather(*(arrive(number) for number in range(500)))
    other = await Store.open(url, "pilot", "0" * 64)
    try:
        sides = (store, other)
        given = await asyncio.gather(
            *(assign(person, cells, side=sides[person.id % 2], seed=person.id) for person in people)
        )
    finally:
        await other.close()
    assert places(given) == [(cell, place) for cell in range(12) for place in range(33)]
    assert given.count(None) == 104


async def test_full_cells_give_no_place_until_somebody_leaves(store, arrive, assign):
    people = [await arrive(number) for number in range(6)]
    given = [await assign(person) for person in people]
    assert given[5] is None
    await store.finish_phase(people[1].id, people[1].phase, people[1].phase, status="timed_out")
    late = await assign(people[5])
    assert (late.cell, late.place) == (given[1].cell, given[1].place)
    assert (await store.assignment(people[1].id)).state == "released"


async def test_an_abandoned_place_goes_to_the_next_person_and_a_finished_one_does_not(store, arrive, assign):
    people = [await arrive(number) for number in range(7)]
    given = [await assign(person) for person in people[:5]]
    await store.finish_phase(people[0].id, people[0].phase, people[0].phase, status="finished")
    later = people[0].created + 2 * ABANDONED
    with at(later):
        for person in people[2:5]:
            await store.beat(person.id)
    got = await assign(people[5], now=later)
    assert (got.cell, got.place) == (given[1].cell, given[1].place)
    assert await assign(people[6], now=later) is None


async def test_room_is_the_number_of_places_that_no_active_participant_holds_or_still_needs(
    store, arrive, assign
):
    async def room(now):
        with at(now):
            return await store.room([3, 2], "consent", ABANDONED)

    person = await arrive(0)
    start = person.created
    assert await room(start) == 5, "a participant in the first phase needs no place yet"
    await assign(person, now=start)
    assert await room(start) == 4
    await arrive(1, phase="instructions")
    assert await room(start) == 3
    assert await room(start + ABANDONED / 2) == 3
    assert await room(start + 2 * ABANDONED) == 5, "both participants have been inactive for too long"


async def test_who_comes_back_gets_the_same_place_if_it_is_free_else_another(store, arrive, assign):
    cells = [CellQuota(1, (1,))]
    first, second, third = [await arrive(number) for number in range(3)]
    given = await assign(first, cells)
    later = first.created + 2 * ABANDONED
    taken = await assign(second, cells, now=later)
    assert taken.place == given.place
    assert await assign(first, cells, now=later) is None
    await store.finish_phase(second.id, second.phase, second.phase, status="withdrawn")
    again = await assign(first, cells, now=later)
    assert (again.place, again.state, again.order_seed) == (given.place, "held", given.order_seed)
    wider = [CellQuota(1, (1,)), CellQuota(1, (2,))]
    assert (await assign(third, wider, now=later + 2 * ABANDONED)).cell == 1
    assert (await assign(first, wider, now=later + 2 * ABANDONED)).cell == 0


async def test_who_finishes_after_the_place_was_given_away_is_one_more_than_wanted(store, arrive, assign):
    cells = [CellQuota(1, (1,))]
    first, second = await arrive(1), await arrive(2)
    await assign(first, cells)
    await assign(second, cells, now=first.created + 2 * ABANDONED)
    assert await store.finish_phase(first.id, first.phase, first.phase, status="finished")
    assert await store.finish_phase(second.id, second.phase, second.phase, status="finished")
    assert (await store.counts()).cells == {0: CellCount(finished=1, released=1)}
    assert (await store.counts()).statuses == {"finished": 2}


async def test_who_withdraws_after_finishing_gives_the_place_up_with_the_data_only(store, arrive, assign):
    first, second = await arrive(1), await arrive(2)
    for person, delete in ((first, False), (second, True)):
        await assign(person)
        await store.finish_phase(person.id, person.phase, person.phase, status="finished")
        await store.withdraw(person.id, delete)
    assert (await store.assignment(first.id)).state == "finished"
    assert (await store.assignment(second.id)).state == "released"


async def test_a_participation_that_is_over_gets_no_place(store, arrive, assign):
    person = await arrive()
    await store.finish_phase(person.id, person.phase, person.phase, status="screened_out")
    with pytest.raises(StoreError, match="has ended"):
        await assign(person)


async def test_a_quota_can_be_changed_while_the_study_runs(store, arrive, assign):
    people = [await arrive(number) for number in range(6)]
    await store.set_quota(0, 1, "ada")
    await store.set_quota(1, 2, "ada")
    given = [await assign(person) for person in people[:4]]
    assert places(given) == [(0, 0), (1, 0), (1, 1)]
    await store.set_quota(0, 2, "ada")
    assert places([await assign(people[4])]) == [(0, 1)]
    assert (await store.study()).quotas == {0: 2, 1: 2}
    assert [entry.details for entry in await store.audit_log()][-1] == {"cell": 0, "wanted": 2}
    with pytest.raises(StoreError, match="cannot have -1"):
        await store.set_quota(0, -1, "ada")


async def test_a_quota_of_zero_closes_a_cell(store, arrive, assign):
    await store.set_quota(0, 0, "ada")
    given = [await assign(await arrive(number)) for number in range(3)]
    assert places(given) == [(1, 0), (1, 1)] and given[2] is None


async def test_counts_by_status_and_cell(store, arrive, assign):
    people = [await arrive(number) for number in range(4)]
    for person in people[:3]:
        await assign(person)
    await store.finish_phase(people[0].id, "consent", "story")
    await store.finish_phase(people[1].id, people[1].phase, people[1].phase, status="finished")
    counts = await store.counts()
    assert counts.statuses == {"arrived": 1, "assigned": 2, "finished": 1}
    assert sum(cell.held for cell in counts.cells.values()) == 2
    assert sum(cell.finished for cell in counts.cells.values()) == 1
