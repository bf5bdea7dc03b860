"""Apply the payment rules of a study, and record the payments that are due."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal

from experiments.errors import StoreError
from experiments.record.phases import ALL_DELIVERED, TASK
from experiments.study.data.collect import person_name
from experiments.study.file import Pay, Study
from experiments.visit.plan import DEBRIEFING, PLAYED
from experiments.visit.store import PaymentEvent, PersonRow, Store, TrialRow
from experiments.visit.store.ledger import ONCE
from experiments.visit.store.values import PaymentKind

GRANT = "grant"  # part of the keys of payments that no rule gives


@dataclass(frozen=True)
class Due:
    """A payment that is due to a participant."""

    person_id: int
    kind: PaymentKind
    key: str
    cents: int
    currency: str
    why: str


def due(
    study: Study, people: Sequence[PersonRow], trials: Sequence[TrialRow], rejected: Collection[int] = ()
) -> list[Due]:
    """Return the payments that the rules of the study require, in the order in which participants arrived.

    Active and rejected participants receive no payments.
    """
    pay, phases = study.settings.pay, study.settings.phases
    delivered = {row.person_id for row in trials if row.phase == TASK and row.ended == ALL_DELIVERED}
    found: list[Due] = []
    for person in people:
        if person.id in rejected:
            continue
        ended = person.status in ("withdrawn", "timed_out")
        if person.status == "finished" or (ended and person.phase == DEBRIEFING):
            found.append(_due(person, "reward", pay.reward, pay, "finished the study"))
            if person.id in delivered:
                found.append(_due(person, "bonus", pay.bonus_for_all, pay, "put everything away"))
        elif person.status == "screened_out":
            why = "no place was left" if person.phase in PLAYED else f"screened out by {person.phase}"
            found.append(_due(person, "screen_out", pay.screen_out, pay, why))
            done = phases.index(person.phase) if person.phase in phases else 0
            worked = done > phases.index(TASK) or (pay.partial and person.phase in PLAYED)
            more = pay.reward * done / len(phases) - pay.screen_out
            if worked and more > 0.0:
                found.append(_due(person, "bonus", more, pay, f"{why} after {done} of {len(phases)} phases"))
        elif ended and pay.partial and person.phase in phases:
            done = phases.index(person.phase)
            if done >= phases.index(TASK):
                left = "left" if person.status == "withdrawn" else "did not return"
                why = f"{left} after {done} of {len(phases)} phases"
                found.append(_due(person, "partial", pay.reward * done / len(phases), pay, why))
    return [payment for payment in found if payment.cents > 0]


def undecided(payments: Sequence[Due], history: Sequence[PaymentEvent]) -> list[Due]:
    """Return the payments that are not in the ledger yet. Later rule changes do not affect old payments."""
    known = {event.key for event in history}
    once = {event.person_id for event in history if event.kind in ONCE}
    return [
        one for one in payments if one.key not in known and not (one.kind in ONCE and one.person_id in once)
    ]


async def decide(store: Store, payments: Sequence[Due]) -> int:
    """Add all new payments to the ledger, and return their number."""
    new = 0
    for payment in undecided(payments, await store.ledger.history()):
        person, kind, cents = payment.person_id, payment.kind, payment.cents
        new += await store.ledger.decide(person, kind, cents, payment.currency, payment.key, payment.why)
    return new


async def reject(store: Store, person: PersonRow, currency: str, why: str) -> None:
    """Record that a participant's work was rejected. The platform is notified when payments are sent.

    Raises:
        StoreError: The participant did not finish the study, or a payment is already recorded.
    """
    name = person_name(person)
    if person.status != "finished":
        raise StoreError(
            f"{name} did not finish the study but is {person.status}; there is nothing to reject"
        )
    if decided := [event.key for event in await store.ledger.history(person.id) if event.kind != "rejection"]:
        raise StoreError(f"{decided[0]} was decided, and stays so; reject before payments are decided")
    await store.ledger.decide(person.id, "rejection", 0, currency, f"{name}-rejection", why)


async def grant(store: Store, person: PersonRow, amount: Decimal, currency: str, why: str) -> str:
    """Record that a participant is owed an amount that no rule gives. Return the key of the payment.

    Raises:
        StoreError: The participant was already granted the same amount for the same reason.
    """
    cents = int(amount * 100)
    given = [event for event in await store.ledger.history(person.id) if event.event == "decided"]
    earlier = [event for event in given if f"-{GRANT}-" in event.key]
    if same := [event.key for event in earlier if (event.cents, event.note) == (cents, why)]:
        raise StoreError(
            f"{same[0]} is the same amount for the same reason; give another reason to pay again"
        )
    key = f"{person_name(person)}-{GRANT}-{len(earlier) + 1}"
    await store.ledger.decide(person.id, "bonus", cents, currency, key, why)
    details = {"person": person.id, "key": key, "cents": cents, "currency": currency, "reason": why}
    await store.audit("command line", "payment granted", details)
    return key


def _due(person: PersonRow, kind: PaymentKind, amount: float, pay: Pay, why: str) -> Due:
    cents = int((Decimal(str(amount)) * 100).to_integral_value(ROUND_HALF_UP))
    return Due(person.id, kind, f"{person_name(person)}-{kind}", cents, pay.currency, why)
