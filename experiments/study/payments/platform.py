"""Payment interface of recruitment platforms, and an HTTP client for their APIs."""

import asyncio
import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, Protocol

import httpx

from experiments.errors import ConfigError, ExperimentError
from experiments.visit.store.values import PaymentKind

TIMEOUT = 30.0  # timeout for a response, in seconds; other processes may retry after ten minutes
# maximum number of attempts if requests are rate-limited, and the longest delay between two, in seconds
TRIES, LONGEST_WAIT = 4, 60.0
LISTED_AFTER = timedelta(minutes=10)
MAX_TEXT = 300  # maximum length of a platform's error message, in characters
TOO_MANY = 429


class DeclinedError(ExperimentError):
    """The platform refused the request or could not be reached."""


class StoppedError(DeclinedError):
    """The platform can make no payments, because it is unreachable or rejects the API secret."""


class UnsureError(ExperimentError):
    """It is unknown whether the platform carried out the request."""


@dataclass(frozen=True)
class Order:
    """A payment to be made through a recruitment platform.

    Attributes:
        key: Key of the payment, which is unique among all studies and identical for all attempts.
        attempt: Number of the attempt to make the payment.
        cents: Amount in hundredths of the currency, or 0 for a rejection.
        why: Reason for the payment, which is shown to the participant.
        identity: Ids with which the participant arrived, by query parameter.
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
        """Amount as a decimal number, such as `7.50`."""
        return f"{self.cents // 100}.{self.cents % 100:02}"

    def id(self, name: str) -> str:
        """Return the participant's id that the platform sent in a query parameter.

        Raises:
            DeclinedError: The participant did not come from the platform, or the ids have been erased.
        """
        if not (value := self.identity.get(name, "")):
            raise DeclinedError(f"the person's {name} is not known; pay by hand")
        return value


class Payer(Protocol):
    """Payment client of a recruitment platform. Its methods raise DeclinedError and UnsureError.

    Attributes:
        listed_after: Time until the platform's lists reliably show the outcome of a request.
        shortest_reason: Minimum length of the reason for a rejection, in characters.
    """

    listed_after: timedelta
    shortest_reason: int

    async def find(self, order: Order) -> str | None:
        """Find the payment in the platform's lists and return its reference. Return None if it has not been made."""
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
            DeclinedError: The platform was unreachable or refused the request.
            UnsureError: There is no valid response, so the platform may have carried out the request.
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
        except ValueError as error:  # for example, a proxy may answer with an HTML page
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
    """Read a secret from an environment variable. Raises ConfigError if it is missing or cannot be sent in a header."""
    if not (value := os.environ.get(name, "").strip()):
        raise ConfigError(f"{name} is not set in the environment; it holds the platform's secret for paying")
    if not (value.isascii() and value.isprintable()):
        raise ConfigError(f"{name} has characters that a secret cannot have; copy it again from the platform")
    return value


def _pause(text: str) -> float:
    return min(LONGEST_WAIT, float(text)) if text.isdecimal() else 1.0
