"""Who of a study gets what, and why; the ledger of the store remembers it for ever."""

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal

from experiments.people.collect import person_name
from experiments.people.store import Person, Store, TrialRow
from experiments.people.store.values import PaymentKind
from experiments.people.study_file import Pay, Study
from experiments.record.phases import TASK
from experiments.session.endings import ALL_DELIVERED


@dataclass(frozen=True)
class Due:
    """What somebody gets.

    Attributes:
        key: Names the payment in the ledger.
        cents: Hundredths of the currency.
        why: In words.
    """

    person_id: int
    kind: PaymentKind
    key: str
    cents: int
    currency: str
    why: str

    def __str__(self) -> str:
        return f"{self.key}  {self.cents / 100:.2f} {self.currency}  {self.why}"


def due(study: Study, people: Sequence[Person], trials: Sequence[TrialRow]) -> list[Due]:
    """What people get by the rules of the study file, in order of arrival; nothing for those still under way."""
    pay, phases = study.settings.pay, study.settings.phases
    delivered = {row.person_id for row in trials if row.phase == TASK and row.ended == ALL_DELIVERED}
    found: list[Due] = []
    for person in people:
        if person.status == "finished":
            found.append(_due(person, "reward", pay.reward, pay, "finished the study"))
            if person.id in delivered:
                found.append(_due(person, "bonus", pay.bonus_for_all, pay, "put everything away"))
        elif person.status == "screened_out":
            found.append(_due(person, "screen_out", pay.screen_out, pay, f"screened out by {person.phase}"))
        elif person.status == "withdrawn" and pay.partial and person.phase in phases:
            done = phases.index(person.phase)
            if done >= phases.index(TASK):
                why = f"left after {done} of {len(phases)} phases"
                found.append(_due(person, "partial", pay.reward * done / len(phases), pay, why))
    return [payment for payment in found if payment.cents > 0]


async def decide(store: Store, payments: Sequence[Due]) -> int:
    """Note in the ledger what people get; how many payments are new. Doing it again changes nothing."""
    new = 0
    for payment in payments:
        person, kind, cents = payment.person_id, payment.kind, payment.cents
        new += await store.ledger.decide(person, kind, cents, payment.currency, payment.key, payment.why)
    return new


def _due(person: Person, kind: PaymentKind, amount: float, pay: Pay, why: str) -> Due:
    cents = int((Decimal(str(amount)) * 100).to_integral_value(ROUND_HALF_UP))
    return Due(person.id, kind, f"{person_name(person)}-{kind}", cents, pay.currency, why)
