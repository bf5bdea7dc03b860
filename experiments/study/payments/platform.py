"""Paying people through their platform: what every platform's client is, and how platforms are asked."""

import asyncio
import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, Protocol

import httpx

from experiments.errors import ConfigError, ExperimentError
from experiments.visit.store.values import PaymentKind

TIMEOUT = 30.0  # s for an answer; well below the ten minutes after which the ledger lets others ask
TRIES, LONGEST_WAIT = 4, 60.0  # of requests that come too fast; s
LISTED_AFTER = timedelta(minutes=10)
MAX_TEXT = 300  # characters of what a platform says
TOO_MANY = 429


class DeclinedError(ExperimentError):
    """The platform did certainly not do what it was asked for; the message says why."""


class StoppedError(DeclinedError):
    """The platform can pay nobody at the moment: it is not reached, or does not accept the secret."""


class UnsureError(ExperimentError):
    """Nobody knows whether the platform did what it was asked for."""


@dataclass(frozen=True)
class Order:
    """A payment as a platform is asked for it.

    Attributes:
        key: Names the payment; the same for all attempts, and another one for every other payment of any study.
        attempt: Number of the attempt to send it.
        cents: Hundredths of the currency; 0 for a rejection.
        why: For the person, in words.
        identity: What the platform said of the person on arrival.
        others: Cents of bonuses that the person is known to have received already.
    """

    key: str
    attempt: int
    kind: PaymentKind
    cents: int
    why: str
    identity: Mapping[str, str]
    others: tuple[int, ...] = ()

    @property
    def amount(self) -> str:
        """In units of the currency, such as `7.50`."""
        return f"{self.cents // 100}.{self.cents % 100:02}"

    def id(self, name: str) -> str:
        """One of the platform's ids of the person.

        Raises:
            DeclinedError: The person did not come from the platform, or the ids are erased.
        """
        if not (value := self.identity.get(name, "")):
            raise DeclinedError(f"the person's {name} is not known; pay by hand")
        return value


class Payer(Protocol):
    """A platform's client. The methods raise DeclinedError and UnsureError.

    Attributes:
        listed_after: How long after the platform was asked its lists are sure to show what it did.
        shortest_reason: Characters that it wants to read when somebody is rejected.
    """

    listed_after: timedelta
    shortest_reason: int

    async def find(self, order: Order) -> str | None:
        """The platform's own name for the payment if it has made it."""
        ...

    async def send(self, order: Order) -> str:
        """Let the platform pay; its own name for the payment. An UnsureError is raised where it may have paid."""
        ...

    async def close(self) -> None: ...


class Api:
    """A platform's interface for programs, over HTTP.

    Args:
        url: Where it is.
        headers: Of all requests.
        timeout: For a whole answer, s.
    """

    def __init__(self, url: str, headers: Mapping[str, str], timeout: float = TIMEOUT) -> None:
        self._client = httpx.AsyncClient(base_url=url, headers=headers, timeout=timeout)
        self._timeout = timeout

    async def ask(self, method: str, path: str, **request: Any) -> Any:
        """The JSON of the answer, or None where it is empty.

        Raises:
            DeclinedError: It was not done: the platform was not reached, or says no.
            UnsureError: It may have been done: there is no answer, or none of a platform that is in order.
        """
        for attempt in range(1, TRIES + 1):
            answer = await self._answer(method, path, request)
            if answer.status_code != TOO_MANY or attempt == TRIES:
                break
            await asyncio.sleep(_pause(answer.headers.get("retry-after", "")))
        said = f"{answer.status_code} {' '.join(answer.text.split())[:MAX_TEXT]}".strip()
        if answer.status_code in (401, 403):
            raise StoppedError(f"the platform lets nobody in with this secret: {said}")
        if answer.is_server_error:
            raise UnsureError(f"the platform is in trouble: {said}")
        if not answer.is_success:
            raise DeclinedError(f"the platform says {said}")
        try:
            return answer.json() if answer.content else None
        except ValueError as error:  # a proxy's page, perhaps
            raise UnsureError(f"the platform's answer is not understood: {said}") from error

    async def close(self) -> None:
        await self._client.aclose()

    async def _answer(self, method: str, path: str, request: Mapping[str, Any]) -> httpx.Response:
        try:
            async with asyncio.timeout(self._timeout):
                return await self._client.request(method, path, **request)
        except (httpx.ConnectError, httpx.ConnectTimeout) as error:
            raise StoppedError(f"the platform cannot be reached: {error}") from error
        except (httpx.HTTPError, TimeoutError) as error:
            raise UnsureError(f"no answer of the platform: {error or type(error).__name__}") from error


def secret(name: str) -> str:
    """A secret from the environment; a ConfigError names one that is missing or cannot be sent."""
    if not (value := os.environ.get(name, "").strip()):
        raise ConfigError(f"{name} is not set in the environment; it holds the platform's secret for paying")
    if not (value.isascii() and value.isprintable()):
        raise ConfigError(f"{name} has characters that no secret has; copy it again from the platform")
    return value


def _pause(text: str) -> float:
    """How long a platform wants one to wait, s."""
    return min(LONGEST_WAIT, float(text)) if text.isdecimal() else 1.0
