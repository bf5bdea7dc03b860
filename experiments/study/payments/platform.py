"""The common part of clients that make payments through the APIs of recruitment platforms."""

import asyncio
import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import timedelta
from typing import Any

import httpx

from experiments.errors import ConfigError, ExperimentError
from experiments.visit.store.values import PaymentKind

TIMEOUT = 30.0  # timeout for a complete response in seconds; other processes may retry after ten minutes
# Maximum number of attempts for a rate-limited request, and maximum delay between two attempts, in seconds
TRIES, LONGEST_WAIT = 4, 60.0
MAX_TEXT = 300  # maximum length of a platform's error message, in characters
TOO_MANY = 429


class DeclinedError(ExperimentError):
    """Raised if the platform refuses a request or cannot be reached."""


class StoppedError(DeclinedError):
    """Raised if no payments are possible because the platform is unreachable or rejects the API secret."""


class UnsureError(ExperimentError):
    """Raised if it is unknown whether the platform has carried out a request."""


@dataclass(frozen=True)
class Order:
    """A payment to be made through a recruitment platform.

    Attributes:
        key: Key of the payment, which is unique among all studies and identical for all attempts.
        attempt: Number of the attempt to make the payment.
        cents: Amount in hundredths of the currency, or 0 for a rejection.
        why: Reason for the payment, which is shown to the participant.
        identity: Ids in the participant's link, by query parameter.
        others: Amounts of the bonuses that the participant has already received, in hundredths of the currency.
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
        """The amount as a decimal number, such as `7.50`."""
        return f"{self.cents // 100}.{self.cents % 100:02}"

    def id(self, name: str) -> str:
        """Return the id that the platform added to the participant's link as a query parameter.

        Raises:
            DeclinedError: The participant did not come from the platform, or the ids have been erased.
        """
        if not (value := self.identity.get(name, "")):
            raise DeclinedError(f"the person's {name} is not known; pay by hand")
        return value


class Payer:
    """A client for payments through a recruitment platform's API. Its requests raise DeclinedError or UnsureError.

    Attributes:
        listed_after: Time until the platform's lists reliably show the outcome of a request.
        shortest_reason: Minimum length of the reason for a rejection, in characters.
    """

    listed_after = timedelta(minutes=10)
    shortest_reason = 1

    def __init__(self, url: str, headers: Mapping[str, str]) -> None:
        self._timeout = TIMEOUT
        self._client = httpx.AsyncClient(base_url=url, headers=headers, timeout=TIMEOUT)

    async def find(self, order: Order) -> str | None:
        """Return the reference of the payment in the platform's lists, or None if it has not been made."""
        raise NotImplementedError

    async def send(self, order: Order) -> str:
        """Make a payment, and return its reference. Raises UnsureError if the outcome is unknown."""
        raise NotImplementedError

    async def ask(self, method: str, path: str, **request: Any) -> Any:
        """Send a request and return the JSON of the response, or None if it is empty.

        Raises:
            DeclinedError: The platform could not be reached or refused the request.
            UnsureError: There was no valid response, so the platform may have carried out the request.
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
        except ValueError as error:  # the response may be an HTML page from a proxy
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
            raise UnsureError(f"no answer of the platform: {str(error) or type(error).__name__}") from error


def secret(name: str) -> str:
    """Read a secret from an environment variable. Raises ConfigError if it is missing or invalid."""
    if not (value := os.environ.get(name, "").strip()):
        raise ConfigError(f"{name} is not set in the environment; it holds the platform's secret for paying")
    if not (value.isascii() and value.isprintable()):
        raise ConfigError(f"{name} has characters that a secret cannot have; copy it again from the platform")
    return value


def _pause(text: str) -> float:
    return min(LONGEST_WAIT, float(text)) if text.isdecimal() else 1.0
