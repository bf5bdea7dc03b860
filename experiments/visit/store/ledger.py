"""Record payments to participants in an append-only ledger, which determines the payments that are owed.

Every payment has a key. The event `sending` is written before the request is sent to the platform. If no event follows,
for example after a crash, the payment is in doubt. The platform must then be asked about the key before the
payment is requested again. Times are measured with the database's clock.
"""

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Any, get_args

from sqlalchemy import ColumnElement, insert, select
from sqlalchemy.ext.asyncio import AsyncConnection as Connection

from experiments.errors import StoreError
from experiments.visit.store.part import StorePart, columns_of, database_now, lock_study, transaction
from experiments.visit.store.tables import payment, person
from experiments.visit.store.values import PaymentEvent, PaymentKind

# A participant receives at most one payment of these types.
ONCE: tuple[PaymentKind, ...] = ("reward", "screen_out", "partial")
IN_DOUBT_AFTER = timedelta(minutes=10)
_FIELDS = columns_of(PaymentEvent, payment)


class Ledger(StorePart):
    """A ledger of payment events, which are never changed after they have been recorded."""

    @transaction
    async def decide(
        self,
        connection: Connection,
        person_id: int,
        kind: PaymentKind,
        cents: int,
        currency: str,
        key: str,
        note: str = "",
    ) -> bool:
        """Record that a payment is owed. Return False if it is already recorded.

        Args:
            kind: Type of the payment. A participant receives at most one of `reward`, `screen_out` and `partial`.
            cents: Amount in hundredths of the currency, or 0 for a rejection.
            currency: Three-letter currency code.
            key: Permanent name of the payment, such as `12-reward`, of at most 100 characters.

        Raises:
            StoreError: Another payment has the key, a payment that excludes this one is recorded, or the amount or type
                is not valid.
        """
        _check(kind, cents, currency)
        values: dict[str, Any] = {"person_id": person_id, "kind": kind, "cents": cents, "currency": currency}
        events = await self._events(connection, key)
        if events:
            first = events[0]
            if _same(first) == values:
                return False
            raise StoreError(
                f"Payment {key!r} is {first.kind} of {first.cents} cents {first.currency} for person "
                f"{first.person_id}, and stays so: use another key for another payment."
            )
        await self._check_person(connection, person_id, kind)
        await self._add(connection, key, 0, "decided", note=note, **values)
        return True

    @transaction
    async def begin_sending(self, connection: Connection, key: str) -> int | None:
        """Record a new attempt to send a payment. Return its number, or None if the payment must not be sent now.

        It must not be sent if it has been paid or the outcome of another attempt is unknown. Send the request
        to the platform immediately, with a timeout well below ten minutes. After ten minutes, other callers ask
        the platform about its key.
        """
        events = await self._known(connection, key)
        if events[-1].in_doubt or paid(events):
            return None
        attempt = events[-1].attempt + 1
        await self._add(connection, key, attempt, "sending", **_same(events[0]))
        return attempt

    @transaction
    async def confirm(
        self, connection: Connection, key: str, attempt: int, reference: str, note: str = ""
    ) -> bool:
        """Record that the platform has made a payment. Return False if this has already been recorded."""
        events = await self._known(connection, key)
        if paid(events):
            return False
        values = {**_same(events[0]), "reference": reference, "note": note}
        await self._add(connection, key, attempt, "confirmed", **values)
        return True

    @transaction
    async def fail(self, connection: Connection, key: str, attempt: int, note: str) -> bool:
        """Record that an attempt has definitely failed. Return False if it is not the current attempt.

        Never call this after a timeout or a lost connection, because the platform may have paid.
        """
        events = await self._known(connection, key)
        if (events[-1].event, events[-1].attempt) != ("sending", attempt):
            return False
        await self._add(connection, key, attempt, "failed", note=note, **_same(events[0]))
        return True

    async def owed(self) -> tuple[PaymentEvent, ...]:
        """Return the last event of each unconfirmed payment.

        If the event is `sending`, the payment is in doubt. Ask the platform about the key, but not within
        `IN_DOUBT_AFTER` of the event, and then call :meth:`confirm` or :meth:`fail`.
        """
        payments = by_key(await self.history()).values()
        return tuple(events[-1] for events in payments if not paid(events))

    async def now(self) -> datetime:
        """Return the current time of the database's clock, which is also used to timestamp events."""
        async with self._database.reading() as connection:
            return await database_now(connection)

    async def history(self, person_id: int | None = None) -> tuple[PaymentEvent, ...]:
        """Return the payment events of one or all participants, in order."""
        which = [payment.c.study_id == self._study_id]
        if person_id is not None:
            which.append(payment.c.person_id == person_id)
        async with self._database.reading() as connection:
            return tuple(await events_of(connection, *which))

    async def _known(self, connection: Connection, key: str) -> Sequence[PaymentEvent]:
        events = await self._events(connection, key)
        if not events:
            raise StoreError(f"No payment {key!r} was decided: decide it first.")
        return events

    async def _events(self, connection: Connection, key: str) -> Sequence[PaymentEvent]:
        """Lock the study so that no other process can add events, and return the events of a payment."""
        await lock_study(connection, self._study_id)
        return await events_of(connection, payment.c.study_id == self._study_id, payment.c.key == key)

    async def _check_person(self, connection: Connection, person_id: int, kind: PaymentKind) -> None:
        known = select(person.c.id).where(person.c.id == person_id, person.c.study_id == self._study_id)
        if (await connection.execute(known)).first() is None:
            raise StoreError(f"There is no person {person_id} in this study to be paid.")
        if kind in ONCE:
            given = select(payment.c.key).where(payment.c.person_id == person_id, payment.c.kind.in_(ONCE))
            if (before := (await connection.execute(given)).scalar()) is not None:
                raise StoreError(f"Person {person_id} has payment {before!r}. An addition is a bonus.")

    async def _add(self, connection: Connection, key: str, attempt: int, event: str, **values: Any) -> None:
        row = {"study_id": self._study_id, "key": key, "attempt": attempt, "event": event}
        row |= {"at": await database_now(connection), "reference": "", "note": ""}
        await connection.execute(insert(payment).values(**row | values))


def _check(kind: str, cents: int, currency: str) -> None:
    if kind not in get_args(PaymentKind):
        raise StoreError(f"No kind of payment {kind!r}; there are {', '.join(get_args(PaymentKind))}.")
    if cents < 0 or (kind == "rejection" and cents):
        raise StoreError(f"A {kind} cannot be {cents} cents.")
    if len(currency) != 3 or not currency.isupper():
        raise StoreError(f"{currency!r} is no currency; use three capital letters, such as USD.")


def _same(event: PaymentEvent) -> dict[str, Any]:
    return {name: getattr(event, name) for name in ("person_id", "kind", "cents", "currency")}


async def events_of(connection: Connection, *which: ColumnElement[bool]) -> Sequence[PaymentEvent]:
    query = select(*_FIELDS).where(*which).order_by(payment.c.id)
    return [PaymentEvent(*row) for row in await connection.execute(query)]


def by_key(events: Sequence[PaymentEvent]) -> dict[str, list[PaymentEvent]]:
    found: dict[str, list[PaymentEvent]] = {}
    for event in events:
        found.setdefault(event.key, []).append(event)
    return found


def paid(events: Sequence[PaymentEvent]) -> bool:
    """Return True if one of a payment's events confirms that the platform has paid."""
    return any(event.event == "confirmed" for event in events)
