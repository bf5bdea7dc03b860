"""What people are paid: an append-only list of events, from which follows what is owed.

Every payment has a key. `sending` is on the disk before the platform is asked, so after a crash between the platform's
yes and our note the payment is known to be in doubt: the platform is asked what it knows of the key before anything is
sent again. How long ago that was is told by the database's clock.
"""

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Any, get_args

from sqlalchemy import ColumnElement, insert, select
from sqlalchemy.ext.asyncio import AsyncConnection

from experiments.errors import StoreError
from experiments.visit.store.part import Part, database_now, lock_study
from experiments.visit.store.tables import payment, person
from experiments.visit.store.values import PaymentEvent, PaymentKind

ONCE: tuple[PaymentKind, ...] = (
    "reward",
    "screen_out",
    "partial",
)  # a person gets one of these, and only once
IN_DOUBT_AFTER = timedelta(minutes=10)
_FIELDS = [column for column in payment.c if column.name != "study_id"]


class Ledger(Part):
    """Rows of `payment`, which are never changed."""

    async def decide(
        self,
        person_id: int,
        kind: PaymentKind,
        cents: int,
        currency: str,
        key: str,
        note: str = "",
        now: datetime | None = None,
    ) -> bool:
        """Note that a person is owed something; False if the key has been decided already.

        Args:
            person_id: The person.
            kind: What it is for. A person gets at most one of `reward`, `screen_out` and `partial`.
            cents: Hundredths of the currency; 0 for a rejection.
            currency: Three letters.
            key: Names the payment for ever, such as `12-reward`; at most 100 characters.
            note: Why.
            now: The time, with its zone.

        Raises:
            StoreError: The key stands for something else, or the person has been given one of the kinds that are
                given once, or the amount or kind is unusable.
        """
        _check(kind, cents, currency)
        same = (person_id, kind, cents, currency)
        values: dict[str, Any] = {"person_id": person_id, "kind": kind, "cents": cents, "currency": currency}

        async def work(connection: AsyncConnection) -> bool:
            events = await self._events(connection, key)
            if events:
                first = events[0]
                if (first.person_id, first.kind, first.cents, first.currency) == same:
                    return False
                raise StoreError(
                    f"Payment {key!r} is {first.kind} of {first.cents} cents {first.currency} for person "
                    f"{first.person_id}, and stays so: use another key for another payment."
                )
            await self._check_person(connection, person_id, kind)
            await self._add(connection, key, 0, "decided", now, note=note, **values)
            return True

        return await self._database.write(work)

    async def begin_sending(self, key: str, now: datetime | None = None) -> int | None:
        """Ask for leave to send a payment: the number of this attempt, or None if it must not be sent now.

        It must not if it is paid, or if another attempt is under way or in doubt. Ask the platform at once, with a
        time-out well below ten minutes: after those :meth:`owed` offers the payment to others, who ask the platform
        what it knows of the key.
        """

        async def work(connection: AsyncConnection) -> int | None:
            events = await self._known(connection, key)
            if events[-1].in_doubt or paid(events):
                return None
            attempt = events[-1].attempt + 1
            await self._add(connection, key, attempt, "sending", now, **_same(events[0]))
            return attempt

        return await self._database.write(work)

    async def confirm(
        self, key: str, attempt: int, reference: str, note: str = "", now: datetime | None = None
    ) -> bool:
        """Note that the platform has paid, with its own reference; False if that is known already."""

        async def work(connection: AsyncConnection) -> bool:
            events = await self._known(connection, key)
            if paid(events):
                return False
            values = {**_same(events[0]), "reference": reference, "note": note}
            await self._add(connection, key, attempt, "confirmed", now, **values)
            return True

        return await self._database.write(work)

    async def fail(self, key: str, attempt: int, note: str, now: datetime | None = None) -> bool:
        """Note that the platform has certainly not paid in this attempt, which may be made again; whether it was noted.

        Never call this after a time-out or a lost connection: the payment is in doubt then.
        """

        async def work(connection: AsyncConnection) -> bool:
            events = await self._known(connection, key)
            if (events[-1].event, events[-1].attempt) != ("sending", attempt):
                return False
            await self._add(connection, key, attempt, "failed", now, note=note, **_same(events[0]))
            return True

        return await self._database.write(work)

    async def owed(
        self, now: datetime | None = None, in_doubt_after: timedelta = IN_DOUBT_AFTER
    ) -> tuple[PaymentEvent, ...]:
        """The last events of payments that are not confirmed, without those that somebody began to send a moment ago.

        Where it is `sending`, the payment is in doubt: ask the platform what it knows of the key, then
        :meth:`confirm` or :meth:`fail` that attempt.
        """
        limit = (now or await self.now()) - in_doubt_after
        payments = by_key(await self.history()).values()
        unpaid = [events[-1] for events in payments if not paid(events)]
        return tuple(last for last in unpaid if not last.in_doubt or last.at <= limit)

    async def now(self) -> datetime:
        """The time by the clock that tells when events were noted."""
        async with self._database.reading() as connection:
            return await database_now(connection)

    async def history(self, person_id: int | None = None) -> tuple[PaymentEvent, ...]:
        """Events of a person, or all, in order."""
        which = [payment.c.study_id == self._study_id]
        if person_id is not None:
            which.append(payment.c.person_id == person_id)
        async with self._database.reading() as connection:
            return tuple(await events_of(connection, *which))

    async def _known(self, connection: AsyncConnection, key: str) -> Sequence[PaymentEvent]:
        events = await self._events(connection, key)
        if not events:
            raise StoreError(f"No payment {key!r} was decided: decide it first.")
        return events

    async def _events(self, connection: AsyncConnection, key: str) -> Sequence[PaymentEvent]:
        """Events of a key; nobody adds any until the transaction ends."""
        await lock_study(connection, self._study_id)
        return await events_of(connection, payment.c.study_id == self._study_id, payment.c.key == key)

    async def _check_person(self, connection: AsyncConnection, person_id: int, kind: PaymentKind) -> None:
        known = select(person.c.id).where(person.c.id == person_id, person.c.study_id == self._study_id)
        if (await connection.execute(known)).first() is None:
            raise StoreError(f"There is no person {person_id} in this study to be paid.")
        if kind in ONCE:
            given = select(payment.c.key).where(payment.c.person_id == person_id, payment.c.kind.in_(ONCE))
            if (before := (await connection.execute(given)).scalar()) is not None:
                raise StoreError(
                    f"Person {person_id} has payment {before!r}; what is added to it is a bonus."
                )

    async def _add(
        self,
        connection: AsyncConnection,
        key: str,
        attempt: int,
        event: str,
        now: datetime | None,
        **values: Any,
    ) -> None:
        texts = {"reference": "", "note": ""}
        row = {
            "study_id": self._study_id,
            "key": key,
            "attempt": attempt,
            "event": event,
            "at": now or await database_now(connection),
        }
        await connection.execute(insert(payment).values(**texts | row | values))


def _check(kind: str, cents: int, currency: str) -> None:
    if kind not in get_args(PaymentKind):
        raise StoreError(f"No kind of payment {kind!r}; there are {', '.join(get_args(PaymentKind))}.")
    if cents < 0 or (kind == "rejection" and cents):
        raise StoreError(f"A {kind} cannot be {cents} cents.")
    if len(currency) != 3 or not currency.isupper():
        raise StoreError(f"{currency!r} is no currency; use three capital letters, such as USD.")


def _same(event: PaymentEvent) -> dict[str, Any]:
    """What all events of a payment have in common."""
    return {
        "person_id": event.person_id,
        "kind": event.kind,
        "cents": event.cents,
        "currency": event.currency,
    }


async def events_of(connection: AsyncConnection, *which: ColumnElement[bool]) -> Sequence[PaymentEvent]:
    query = select(*_FIELDS).where(*which).order_by(payment.c.id)
    return [PaymentEvent(*row) for row in await connection.execute(query)]


def by_key(events: Sequence[PaymentEvent]) -> dict[str, list[PaymentEvent]]:
    found: dict[str, list[PaymentEvent]] = {}
    for event in events:
        found.setdefault(event.key, []).append(event)
    return found


def paid(events: Sequence[PaymentEvent]) -> bool:
    """Whether the platform is known to have paid."""
    return any(event.event == "confirmed" for event in events)
