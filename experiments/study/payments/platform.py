"""The payment interface of recruitment platforms, and an HTTP client for their APIs."""

import asyncio
import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, Protocol

import httpx

from experiments.errors import ConfigError, ExperimentError
from experiments.visit.store.values import PaymentKind

TIMEOUT = 30.0  # response timeout, in seconds; less than the ten minutes after which others may retry
# number of attempts at a rate-limited request, and the longest delay between two of them, in seconds
TRIES, LONGEST_WAIT = 4, 60.0
LISTED_AFTER = timedelta(minutes=10)
MAX_TEXT = 300  # maximum length of a platform's message
TOO_MANY = 429


class DeclinedError(ExperimentError):
    """The platform did not carry out the request. The message gives the reason."""


class StoppedError(DeclinedError):
    """The platform cannot pay anyone: it is unreachable, or rejects the secret."""


class UnsureError(ExperimentError):
    """The outcome of the request is unknown."""


@dataclass(frozen=True)
class Order:
    """A payment to be made by a platform.

    Attributes:
        key: Key of the payment, unique among all studies and the same for all attempts.
        attempt: Number of the attempt to send it.
        cents: Hundredths of the currency, 0 for a rejection.
        why: Reason, shown to the participant.
        identity: Ids that the platform sent when the participant arrived.
        others: Bonuses that the participant has already received, in cents.
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
        """Amount in units of the currency, such as `7.50`."""
        return f"{self.cents // 100}.{self.cents % 100:02}"

    def id(self, name: str) -> str:
        """Return one of the ids that the platform sent, by the name of its query parameter.

        Raises:
            DeclinedError: The participant did not come from the platform, or the ids are erased.
        """
        if not (value := self.identity.get(name, "")):
            raise DeclinedError(f"the person's {name} is not known; pay by hand")
        return value


class Payer(Protocol):
    """Client of a recruitment platform. Its methods raise DeclinedError and UnsureError.

    Attributes:
        listed_after: Time after which the platform's lists reliably show the outcome of a request.
        shortest_reason: Minimum length of the reason for a rejection, in characters.
    """

    listed_after: timedelta
    shortest_reason: int

    async def find(self, order: Order) -> str | None:
        """Look for the payment on the platform. Return its reference, or None if it has not been made."""
        ...

    async def send(self, order: Order) -> str:
        """Make the payment and return its reference. Raises UnsureError if the platform may have paid."""
        ...

    async def close(self) -> None: ...


class Api:
    """HTTP client of a platform's API.

    Args:
        timeout: Timeout for a complete response, in seconds.
    """

    def __init__(self, url: str, headers: Mapping[str, str], timeout: float = TIMEOUT) -> None:
        self._client = httpx.AsyncClient(base_url=url, headers=headers, timeout=timeout)
        self._timeout = timeout

    async def ask(self, method: str, path: str, **request: Any) -> Any:
        """Send a request and return the JSON of the response, or None if it is empty.

        Raises:
            DeclinedError: The request was not carried out, because the platform was unreachable or refused it.
            UnsureError: The request may have been carried out, because there is no valid response.
        """
        for attempt in range(1, TRIES + 1):
            answer = await self._answer(method, path, request)
            if answer.status_code != TOO_MANY or attempt == TRIES:
                break
            await asyncio.sleep(_pause(answer.headers.get("retry-after", "")))
        said = f"{answer.status_code} {' '.join(answer.text.split())[:MAX_TEXT]}".strip()
        if answer.status_code in (401, 403):
            raise StoppedError(f"the platform rejects this secret: {said}")
        if answer.is_server_error:
            raise UnsureError(f"the platform failed: {said}")
        if not answer.is_success:
            raise DeclinedError(f"the platform says {said}")
        try:
            return answer.json() if answer.content else None
        except ValueError as error:  # such as the error page of a proxy
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
    """Return a secret from the environment. Raises ConfigError if it is missing or cannot be sent."""
    if not (value := os.environ.get(name, "").strip()):
        raise ConfigError(f"{name} is not set in the environment; it holds the platform's secret for paying")
    if not (value.isascii() and value.isprintable()):
        raise ConfigError(f"{name} has characters that a secret cannot have; copy it again from the platform")
    return value


def _pause(text: str) -> float:
    return min(LONGEST_WAIT, float(text)) if text.isdecimal() else 1.0
