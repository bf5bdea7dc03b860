"""Pay through whole histories: what every person gets is that of the rules when it was decided, and stays so."""

from datetime import UTC, datetime
from fractions import Fraction
from types import SimpleNamespace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.errors import StoreError
from experiments.study.file import Pay
from experiments.study.payments.rules import due, reject, undecided
from experiments.visit.store import PaymentEvent, PersonRow, Store, TrialRow

PHASES = ["consent", "device", "story", "training", "task", "survey", "completion"]
NOON = datetime(2026, 5, 1, 12, tzinfo=UTC)
ACTIVE = "assigned"
ONCE = {"reward", "screen_out", "partial"}
# How people stand, and in which phase; what pays by the share of phases comes as often as the rest.
ENDS = st.one_of(
    st.sampled_from([(ACTIVE, "task"), ("finished", "completion"), ("no_consent", "consent")]),
    st.tuples(st.sampled_from(["screened_out", "withdrawn", "timed_out"]), st.sampled_from(PHASES[:-1])),
    st.tuples(
        st.sampled_from(["screened_out", "withdrawn"]), st.sampled_from(["training", "task", "survey"])
    ),
)
CENTS = st.one_of(
    st.just(0), st.integers(0, 2000)
)  # often nothing, so that a later rule is the first that pays
RULES = st.builds(
    lambda reward, screen_out, bonus, partial: Pay(
        currency="EUR", reward=reward / 100, screen_out=screen_out / 100, bonus_for_all=bonus / 100, partial=partial
    ),
    CENTS, CENTS, CENTS, st.booleans(),
)  # fmt: skip
# Of each person, at each decision: how they stand, whether they put everything away, and whether they are rejected.
STANDING = st.tuples(ENDS, st.booleans(), st.sampled_from([False, False, True]))
DECISIONS = 3
HISTORIES = st.lists(st.lists(STANDING, min_size=DECISIONS, max_size=DECISIONS), min_size=1, max_size=6)


def oracle(pay, status, phase, delivered):
    """Cents by kind, from the documented rules, exactly: docs/study.md."""
    reward, screen_out = Fraction(str(pay.reward)), Fraction(str(pay.screen_out))
    share, found = reward * PHASES.index(phase) / len(PHASES), {}
    if status == "finished":
        found = {"reward": reward, "bonus": Fraction(str(pay.bonus_for_all)) if delivered else 0}
    elif status == "screened_out":
        found = {"screen_out": screen_out}
        if phase == "survey" or (pay.partial and phase in ("training", "task")):
            found["bonus"] = share - screen_out
    elif status in ("withdrawn", "timed_out") and pay.partial and PHASES.index(phase) >= PHASES.index("task"):
        found = {"partial": share}
    return {kind: 100 * amount for kind, amount in found.items()}


def person(number, status, phase):
    return PersonRow(number, f"{number:064}", "link", status, phase, NOON, NOON, delete_wanted=False)


@settings(max_examples=300)
@given(people=HISTORIES, rules=st.lists(RULES, min_size=DECISIONS, max_size=DECISIONS))
def test_each_person_gets_what_the_rules_said_first(people, rules):
    """Rules change between decisions, and so may how people stand; no person gets two payments of those given once."""
    ledger, expected = [], {}
    for decision, pay in enumerate(rules):
        now = dict(enumerate((history[decision] for history in people), 1))
        here = [person(number, *end) for number, (end, _, _) in now.items()]
        trials = [
            TrialRow(number, "task", "x", "all delivered" if delivered else "time is up", NOON)
            for number, (_, delivered, _) in now.items()
        ]
        rejected = {number for number, (_, _, refused) in now.items() if refused}
        study = SimpleNamespace(settings=SimpleNamespace(pay=pay, phases=PHASES))
        new = undecided(due(study, here, trials, rejected), ledger)
        for number, (end, delivered, refused) in now.items():
            if refused:
                continue
            mine = {kind for owner, kind in expected if owner == number}
            for kind, cents in oracle(pay, *end, delivered).items():
                again = kind in mine or (kind in ONCE and mine & ONCE)
                if cents >= Fraction(1, 2) and not again:
                    expected[number, kind] = cents
        ledger += [
            PaymentEvent(
                0, one.person_id, one.key, 0, "decided", one.kind, one.cents, "EUR", "", one.why, NOON
            )
            for one in new
        ]
        assert {(event.person_id, event.kind) for event in ledger} == set(expected)
        assert len({event.key for event in ledger}) == len(ledger)
    for event in ledger:  # half a cent is rounded up
        assert -0.5 - 1e-6 < event.cents - expected[event.person_id, event.kind] <= 0.5 + 1e-6


@pytest.fixture
def anyio_backend():
    return "asyncio"


@pytest.mark.anyio
@pytest.mark.parametrize("status", [None, "withdrawn", "screened_out", "timed_out", "no_consent"])
async def test_only_a_person_who_finished_is_rejected(tmp_path, status):
    store = await Store.open(f"sqlite:///{tmp_path / 'study.db'}", "study", "0" * 64)
    try:
        arrived = await store.arrive("link", None, {}, "1" * 64, "task")
        if status:
            await store.finish_phase(arrived.id, arrived.phase, arrived.phase, status=status)
        with pytest.raises(StoreError, match=r"did not finish the study .*nothing to reject"):
            await reject(store, await store.person(arrived.id), "EUR", "too fast")
        assert await store.ledger.history() == ()
    finally:
        await store.close()


@pytest.mark.anyio
async def test_a_person_whose_pay_is_decided_is_not_rejected(tmp_path):
    store = await Store.open(f"sqlite:///{tmp_path / 'study.db'}", "study", "0" * 64)
    try:
        for number in (1, 2):
            arrived = await store.arrive("link", None, {}, f"{number}" * 64, "task")
            await store.finish_phase(arrived.id, "task", "completion", {}, status="finished")
        await store.ledger.decide(1, "reward", 100, "EUR", "p00001-reward")
        with pytest.raises(StoreError, match="p00001-reward was decided"):
            await reject(store, await store.person(1), "EUR", "too fast")
        for _ in range(2):
            await reject(store, await store.person(2), "EUR", "too fast")
        assert [event.key for event in await store.ledger.history()] == ["p00001-reward", "p00002-rejection"]
    finally:
        await store.close()
