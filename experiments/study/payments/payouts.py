"""Send all owed payments to the recruitment platform without paying twice."""

from collections.abc import AsyncIterator, Awaitable
from dataclasses import dataclass
from typing import Literal, TypeVar

from experiments.study.payments.platform import DeclinedError, Order, Payer, StoppedError, UnsureError
from experiments.visit.store import PaymentEvent, Store
from experiments.visit.store.ledger import IN_DOUBT_AFTER

T = TypeVar("T")


@dataclass(frozen=True)
class Sent:
    """The result of an attempt to send a payment.

    Attributes:
        key: Key of the payment in the ledger.
        state: `paid`, `refused` (another attempt is possible) or `in doubt` (the platform may have paid).
        text: Reference of the payment on the platform, or the reason why it was not made.
        stops: True if the platform currently cannot make any payments.
    """

    key: str
    state: Literal["paid", "refused", "in doubt"]
    text: str
    stops: bool = False


class Sender:
    """A client that makes due payments through the recruitment platform.

    Each attempt is recorded in the ledger before the request is sent. If the outcome of an attempt is unknown, the
    payment is sent again only if it is still missing from the platform's lists after a waiting time.
    """

    def __init__(self, study: str, store: Store, payer: Payer) -> None:
        self._study, self._ledger, self._identity, self._payer = study, store.ledger, store.identity, payer

    async def send(self) -> AsyncIterator[Sent]:
        """Send all owed payments, and yield the result of each payment."""
        for last in await self._ledger.owed():
            done = await self._settle(last) if last.in_doubt else None
            if done is None:
                attempt = await self._ledger.begin_sending(last.key)
                if attempt is None:
                    continue  # another process is sending this payment
                done = await self._send(last.key, await self._order(last, attempt))
            yield done
            if done.stops:
                return

    async def _settle(self, last: PaymentEvent) -> Sent | None:
        later = last.at + max(IN_DOUBT_AFTER, self._payer.listed_after)
        if later > await self._ledger.now():
            again = f"{later:%Y-%m-%d %H:%M} UTC"
            return Sent(last.key, "in doubt", f"sent without an answer; run this again after {again}")
        order = await self._order(last, last.attempt)
        try:
            reference = await _understood(self._payer.find(order))
        except (DeclinedError, UnsureError) as error:
            text = _without_ids(f"the platform did not tell whether it has paid: {error}", order)
            return Sent(last.key, "in doubt", text, isinstance(error, StoppedError))
        if reference is not None:
            await self._ledger.confirm(last.key, last.attempt, reference, "the platform knew of it")
            return Sent(last.key, "paid", f"{reference}, as the platform says")
        if await self._ledger.fail(last.key, last.attempt, "the platform does not know of it"):
            return None
        return Sent(last.key, "in doubt", "another process is sending it")

    async def _send(self, key: str, order: Order) -> Sent:
        try:
            reference = await _understood(self._payer.send(order))
        except UnsureError as error:
            return Sent(key, "in doubt", _without_ids(str(error), order))
        except DeclinedError as error:
            stops = isinstance(error, StoppedError)
            before = None if stops else await self._made_before(order)
            if before is None:
                text = _without_ids(str(error), order)
                await self._ledger.fail(key, order.attempt, text)
                return Sent(key, "refused", text, stops)
            reference = before
        await self._ledger.confirm(key, order.attempt, reference)
        return Sent(key, "paid", reference)

    async def _made_before(self, order: Order) -> str | None:
        try:
            return await _understood(self._payer.find(order))
        except (DeclinedError, UnsureError):
            return None

    async def _order(self, event: PaymentEvent, attempt: int) -> Order:
        history = await self._ledger.history(event.person_id)
        received = [
            one.cents
            for one in history
            if one.event == "confirmed" and one.kind not in ("reward", "rejection")
        ]
        why = next(one.note for one in history if one.key == event.key)
        name, identity = f"{self._study}/{event.key}", await self._identity(event.person_id)
        return Order(name, attempt, event.kind, event.cents, why, identity, tuple(received))


async def _understood(answer: Awaitable[T]) -> T:
    try:
        return await answer
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise UnsureError(f"the platform's answer is not understood: {error!r}") from error


def _without_ids(text: str, order: Order) -> str:
    for value in filter(None, order.identity.values()):
        text = text.replace(value, "...")
    return text
