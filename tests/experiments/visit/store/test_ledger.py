"""The ledger: nobody is paid twice, and everybody once, whatever happens between two steps of who pays."""

import asyncio
from datetime import UTC, datetime, timedelta
from itertools import count

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from store_clock import at

from experiments.errors import StoreError
from experiments.visit.store import Store
from experiments.visit.store.ledger import IN_DOUBT_AFTER

pytestmark = pytest.mark.anyio

NOON = datetime(2026, 5, 1, 12, tzinfo=UTC)
NUMBERS = count(1000)


async def test_a_payment_is_decided_sent_and_confirmed_once(store, arrive):
    person, ledger = await arrive(), store.ledger
    assert await ledger.decide(person.id, "reward", 750, "USD", "1-reward", "finished")
    assert not await ledger.decide(person.id, "reward", 750, "USD", "1-reward", "finished")
    [owed] = await ledger.owed()
    assert (owed.person_id, owed.key, owed.cents, owed.note) == (person.id, "1-reward", 750, "finished")
    assert await ledger.begin_sending("1-reward") == 1
    assert await ledger.confirm("1-reward", 1, "reference of the platform")
    assert not await ledger.confirm("1-reward", 1, "reference of the platform")
    assert await ledger.begin_sending("1-reward") is None
    assert not await ledger.fail("1-reward", 1, "too late")
    assert await ledger.owed() == ()
    events = await ledger.history(person.id)
    assert [event.event for event in events] == ["decided", "sending", "confirmed"]
    assert events[-1].reference == "reference of the platform"


async def test_only_one_of_many_may_send_and_only_after_failure_again(store, url, arrive):
    person = await arrive()
    await store.ledger.decide(person.id, "bonus", 100, "USD", "b")
    other = await Store.open(url, "pilot", "0" * 64)
    try:
        sides = [store.ledger, other.ledger] * 4
        assert sorted(await asyncio.gather(*(side.begin_sending("b") for side in sides)), key=str) == [
            1,
            *[None] * 7,
        ]
        assert await store.ledger.fail("b", 1, "no money left")
        assert sorted(await asyncio.gather(*(side.begin_sending("b") for side in sides)), key=str) == [
            2,
            *[None] * 7,
        ]
        assert not await store.ledger.fail("b", 1, "of the first attempt, late")
    finally:
        await other.close()


async def test_what_is_being_sent_is_in_doubt(store, arrive):
    person, ledger = await arrive(), store.ledger
    with at(NOON):
        await ledger.decide(person.id, "reward", 750, "USD", "r")
        await ledger.begin_sending("r")
    [owed] = await ledger.owed()
    assert (owed.in_doubt, owed.attempt, owed.at) == (True, 1, NOON)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (("reward", 751, "USD", "r"), "stays so"),
        (("partial", 100, "USD", "p"), "is a bonus"),
        (("tip", 100, "USD", "t"), "No kind"),
        (("bonus", -1, "USD", "b"), "cannot be -1"),
        (("rejection", 1, "USD", "x"), "cannot be 1"),
        (("bonus", 1, "$", "b"), "no currency"),
    ],
)
async def test_what_cannot_be_decided(store, arrive, values, message):
    person = await arrive()
    await store.ledger.decide(person.id, "reward", 750, "USD", "r")
    with pytest.raises(StoreError, match=message):
        await store.ledger.decide(person.id, *values)
    assert len(await store.ledger.history()) == 1


async def test_unknown_people_and_keys(store):
    with pytest.raises(StoreError, match="no person 5"):
        await store.ledger.decide(5, "reward", 750, "USD", "r")
    with pytest.raises(StoreError, match="decide it first"):
        await store.ledger.begin_sending("r")


class Platform:
    """Pays whatever it is asked to, as often as it is asked; knows what it paid. Requests may take a minute."""

    def __init__(self):
        self.now = NOON
        self.paid, self.under_way = [], []

    def ask(self, key):
        self.under_way.append((self.now, key))

    def deliver(self, before):
        self.paid += [key for sent, key in self.under_way if sent <= before]
        self.under_way = [(sent, key) for sent, key in self.under_way if sent > before]

    def wait(self, seconds):
        self.now += timedelta(seconds=seconds)
        self.deliver(self.now - timedelta(seconds=60))


async def payer(ledger, platform):
    """Pays what is owed; stops for a moment at each `yield`, where it may be killed."""
    for owed in await ledger.owed():
        if owed.in_doubt and owed.at > platform.now - IN_DOUBT_AFTER:
            continue
        yield
        if owed.in_doubt:
            known = owed.key in platform.paid
            yield
            if known:
                with at(platform.now):
                    await ledger.confirm(owed.key, owed.attempt, "found")
                continue
            with at(platform.now):
                await ledger.fail(owed.key, owed.attempt, "unknown to the platform")
            yield
        begun = platform.now
        with at(begun):
            attempt = await ledger.begin_sending(owed.key)
        yield
        if attempt is None or platform.now - begun > timedelta(minutes=5):
            continue
        platform.ask(owed.key)
        yield
        if owed.key in platform.paid:
            with at(platform.now):
                await ledger.confirm(owed.key, attempt, "paid")
        yield


STEPS = st.lists(
    st.one_of(
        st.tuples(st.sampled_from(["step", "kill"]), st.integers(0, 2), st.integers(1, 6)),
        st.tuples(st.just("step"), st.integers(0, 2), st.integers(1, 6)),
        st.tuples(st.just("wait"), st.sampled_from([1, 61, 700]), st.just(1)),
    ),
    min_size=8,
    max_size=25,
)


@given(steps=STEPS)
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
async def test_whatever_happens_everybody_is_paid_exactly_once(url, steps):
    number = next(NUMBERS)
    store = await Store.open(url, f"study {number}", "0" * 64)
    try:
        await _pay(store, steps, number)
    finally:
        await store.close()


async def _pay(store, steps, number):
    platform, ledger = Platform(), store.ledger
    person = await store.arrive("link", None, {}, f"{number:064x}", "consent")
    keys = [f"{person.id}-{kind}" for kind in ("reward", "bonus")]
    for key in keys:
        with at(NOON):
            await ledger.decide(person.id, key.partition("-")[2], 750, "USD", key)
    payers = [payer(ledger, platform) for _ in range(3)]
    for what, value, times in steps:
        if what == "wait":
            platform.wait(value)
            continue
        for _ in range(times):
            if await anext(payers[value], "done") == "done":
                payers[value] = payer(ledger, platform)
        if what == "kill":
            await payers[value].aclose()
            payers[value] = payer(ledger, platform)
        assert len(platform.paid) == len(set(platform.paid))
    for running in payers:
        await running.aclose()
    for _ in range(4):
        platform.wait(700)
        async for _ in payer(ledger, platform):
            platform.deliver(platform.now)
    assert sorted(platform.paid) == sorted(keys)
    assert await ledger.owed() == ()
