"""The HTTP client of recruitment platforms: how long it waits before it repeats a request."""

import asyncio

import httpx
import pytest

from experiments.study.payments.platform import LONGEST_WAIT, TOO_MANY, TRIES, Api, DeclinedError


def asked(monkeypatch, headers, busy):
    """Ask a platform that is too busy for the first `busy` requests. Return the pauses and the answer."""
    pauses, answers = [], iter([httpx.Response(TOO_MANY, headers=headers)] * busy)

    async def sleep(seconds):
        pauses.append(seconds)

    async def run():
        api = Api("http://platform.example", {})
        transport = httpx.MockTransport(lambda _: next(answers, httpx.Response(200, json="paid")))
        api._client = httpx.AsyncClient(base_url="http://platform.example", transport=transport)
        try:
            return await api.ask("POST", "/pay")
        finally:
            await api.close()

    monkeypatch.setattr("experiments.study.payments.platform.asyncio.sleep", sleep)
    try:
        return pauses, asyncio.run(run())
    except DeclinedError as error:
        return pauses, error


@pytest.mark.parametrize(
    ("header", "pause"),
    [
        ("7", 7.0),
        ("0", 0.0),
        ("100000", LONGEST_WAIT),
        ("", 1.0),
        ("Wed, 21 Oct 2026 07:28:00 GMT", 1.0),
        ("-5", 1.0),
    ],
)
def test_the_platform_says_when_to_ask_again_within_a_minute(monkeypatch, header, pause):
    pauses, answer = asked(monkeypatch, {"Retry-After": header}, busy=2)
    assert (pauses, answer) == ([pause, pause], "paid")
    assert LONGEST_WAIT == 60.0


def test_a_request_is_given_up_without_a_last_pause(monkeypatch):
    pauses, answer = asked(monkeypatch, {}, busy=TRIES)
    assert pauses == [1.0] * (TRIES - 1)
    assert isinstance(answer, DeclinedError) and "429" in str(answer)
