"""The HTTP client of recruitment platforms: when it repeats a request, and which outcomes it knows for certain."""

import asyncio
import os
from datetime import timedelta

import httpx
import pytest

from experiments.errors import ConfigError
from experiments.study.file import Recruitment
from experiments.study.payments.platform import (
    LONGEST_WAIT,
    MAX_TEXT,
    TIMEOUT,
    TOO_MANY,
    TRIES,
    DeclinedError,
    Order,
    Payer,
    StoppedError,
    UnsureError,
    secret,
)
from experiments.study.recruitment.connect import ConnectPayer
from experiments.study.recruitment.external_question import ExternalQuestionPayer
from experiments.study.recruitment.prolific import ProlificPayer
from experiments.visit.store.ledger import IN_DOUBT_AFTER

PAYERS = (ProlificPayer, ConnectPayer, ExternalQuestionPayer)


def asked(monkeypatch, headers, busy):
    """Ask a platform that is too busy for the first `busy` requests. Return the pauses and the answer."""
    pauses, answers = [], iter([httpx.Response(TOO_MANY, headers=headers)] * busy)

    async def sleep(seconds):
        pauses.append(seconds)

    async def run():
        api = Payer("http://platform.example", {})
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


def outcome(answer):
    """Return the result of a request that a platform answers in this way, or the error that it leads to."""

    async def respond(_):
        if isinstance(answer, Exception):
            raise answer
        if answer == "never":
            await asyncio.sleep(60.0)
        return answer

    async def run():
        api = Payer("http://platform.example", {})
        api._timeout = 0.05
        api._client = httpx.AsyncClient(
            base_url="http://platform.example", transport=httpx.MockTransport(respond)
        )
        try:
            return await api.ask("POST", "/pay")
        finally:
            await api.close()

    try:
        return asyncio.run(run())
    except (DeclinedError, UnsureError) as error:
        return error


@pytest.mark.parametrize(
    ("answer", "kind", "message"),
    [
        (httpx.ConnectError("refused"), StoppedError, "the platform cannot be reached: refused"),
        (httpx.ConnectTimeout("slow"), StoppedError, "the platform cannot be reached: slow"),
        (httpx.ReadError("reset"), UnsureError, "no answer of the platform: reset"),
        (httpx.ReadTimeout(""), UnsureError, "no answer of the platform: ReadTimeout"),
        (httpx.RemoteProtocolError("cut off"), UnsureError, "no answer of the platform: cut off"),
        ("never", UnsureError, "no answer of the platform: TimeoutError"),
        (httpx.Response(401), StoppedError, "the platform rejects this secret: 401"),
        (
            httpx.Response(403, text="no  scope"),
            StoppedError,
            "the platform rejects this secret: 403 no scope",
        ),
        (httpx.Response(400, text="bad"), DeclinedError, "the platform says 400 bad"),
        (httpx.Response(404), DeclinedError, "the platform says 404"),
        (httpx.Response(302), DeclinedError, "the platform says 302"),
        (httpx.Response(500, text="oops"), UnsureError, "the platform failed: 500 oops"),
        (httpx.Response(503), UnsureError, "the platform failed: 503"),
        (
            httpx.Response(200, text="<html>"),
            UnsureError,
            "the platform's answer is not understood: 200 <html>",
        ),
        (httpx.Response(400, text="x" * 999), DeclinedError, "the platform says 400 " + "x" * MAX_TEXT),
    ],
)
def test_an_error_says_whether_the_platform_may_have_paid_and_whether_it_will_pay_others(
    answer, kind, message
):
    found = outcome(answer)
    assert (type(found), str(found)) == (kind, message)


def test_answers_are_json_or_empty():
    assert outcome(httpx.Response(200, json={"id": 7})) == {"id": 7}
    assert outcome(httpx.Response(201, json=[])) == []
    assert outcome(httpx.Response(204)) is None


@pytest.mark.parametrize(
    ("cents", "amount"),
    [(0, "0.00"), (5, "0.05"), (750, "7.50"), (100, "1.00"), (99, "0.99"), (123456, "1234.56")],
)
def test_an_order_has_a_decimal_amount_and_the_ids_of_the_person(cents, amount):
    order = Order("key", 1, "bonus", cents, "why", {"PROLIFIC_PID": "anna", "SESSION_ID": ""})
    assert order.amount == amount
    assert order.id("PROLIFIC_PID") == "anna"
    for missing in ("SESSION_ID", "STUDY_ID"):
        with pytest.raises(DeclinedError, match=f"the person's {missing} is not known; pay by hand"):
            order.id(missing)


def test_a_secret_is_read_without_spaces_around_it_and_refused_if_it_cannot_be_one(monkeypatch):
    monkeypatch.setenv("PAY_SECRET", "  abc-123 \n")
    assert secret("PAY_SECRET") == "abc-123"
    for value, fault in (
        ("", "is not set"),
        ("  ", "is not set"),
        ("käse", "characters"),
        ("a\tb", "characters"),
    ):
        monkeypatch.setenv("PAY_SECRET", value)
        with pytest.raises(ConfigError, match=fault):
            secret("PAY_SECRET")
    monkeypatch.delenv("PAY_SECRET")
    with pytest.raises(ConfigError, match="PAY_SECRET is not set"):
        secret("PAY_SECRET")


def test_a_request_is_over_long_before_another_process_may_repeat_it():
    longest, later = TRIES * TIMEOUT + (TRIES - 1) * LONGEST_WAIT, IN_DOUBT_AFTER.total_seconds()
    assert (longest, later) == (300.0, 600.0)


def test_platforms_say_how_late_their_lists_are_and_how_long_a_reason_must_be():
    found = {payer.__name__: (payer.listed_after, payer.shortest_reason) for payer in PAYERS}
    assert found == {
        "ProlificPayer": (timedelta(hours=1), 100),
        "ConnectPayer": (timedelta(minutes=10), 1),
        "ExternalQuestionPayer": (timedelta(minutes=10), 1),
    }


def test_a_payer_needs_the_secret_of_its_platform_and_where_its_interface_is(monkeypatch):
    for name in [name for name in os.environ if name.startswith("MJSIM_")]:
        monkeypatch.delenv(name)
    site = "https://api.example.org"
    for payer in PAYERS:
        with pytest.raises(ConfigError, match="is not set in the environment"):
            payer(Recruitment(platform="prolific", api_url=site))
    with pytest.raises(ConfigError, match="api_url is empty"):
        ExternalQuestionPayer(Recruitment(platform="external-question"))
