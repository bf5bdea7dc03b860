"""Paying through a platform, over real HTTP: what is owed is paid once, whatever fails on the way."""

import asyncio
import dataclasses
import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections import Counter

import msgspec
import pytest
from study_database import new_database

from experiments.cli.main import main
from experiments.study.file import read_people_study
from experiments.study.payments.payouts import Sender
from experiments.study.payments.platform import TRIES, DeclinedError, Payer, StoppedError, UnsureError
from experiments.study.recruitment import payer
from experiments.visit.store import Store
from tests.experiments.study.platforms.connect import Connect
from tests.experiments.study.platforms.emulator import PATIENCE, SECRET
from tests.experiments.study.platforms.external_question import ExternalQuestion
from tests.experiments.study.platforms.prolific import Prolific

PLATFORMS = {"prolific": Prolific, "connect": Connect, "external-question": ExternalQuestion}
STUDY = """
[[cells]]
assistance = "none"
objects = 1
people = 4
house_seeds = 0
fidelity = "event"

[study]
name = "paid"
title = "A study"
institution = "a test"
contact = "nobody@example.org"

[study.pay]
reward = 7.50
bonus_for_all = 1.00
screen_out = 0.50
partial = true

[study.recruitment]
platform = "{platform}"
completed = "C0MPLETE"
screened_out = "SCREEN0UT"
no_consent = "N0C0NSENT"
sites = ["{url}"]
api_url = "{url}"
"""


@pytest.fixture(params=list(PLATFORMS))
def platform(request, monkeypatch):
    with PLATFORMS[request.param]().running() as running:
        monkeypatch.setenv(running.variable, SECRET)
        running.name = request.param
        yield running


class Paid:
    """A study of which two people have finished, one of whom put everything away."""

    def __init__(self, folder, platform):
        self.folder, self.platform = folder, platform
        self.file = folder / "study.toml"
        self.file.write_text(STUDY.format(platform=platform.name, url=platform.url))
        self.study = read_people_study(self.file)
        self.url = new_database(folder / "study.db")
        asyncio.run(self._fill())
        self.words = ["study", "pay", str(self.file), str(folder), "--without-rehearsal"]

    async def open(self):
        return await Store.open(self.url, self.study.settings.name, self.study.sha256)

    async def _fill(self):
        store = await self.open()
        for number in (1, 2):
            person = await self._arrive(store, number, self.platform.add(number), "survey")
            if number == 1:
                await store.finish_trial(person.id, "task", "x", "all delivered")
            await store.finish_phase(person.id, "survey", "completion", {}, status="finished")
        await store.close()

    async def _arrive(self, store, number, ids, phase):
        return await store.arrive(self.platform.name, f"{number:064}", ids, f"{number:064}", phase)

    def leave(self, number, ids, phase, status):
        """Somebody who leaves before the end."""

        async def run():
            store = await self.open()
            person = await self._arrive(store, number, ids, phase)
            await store.finish_phase(person.id, person.phase, person.phase, status=status)
            await store.close()

        asyncio.run(run())

    def send(self, timeout=0.5):
        """Send what is decided; what became of each payment."""

        async def run():
            store = await self.open()
            client = payer(self.study.settings)
            client._timeout = timeout
            try:
                return [sent async for sent in Sender("paid", store, client).send()]
            finally:
                await client.close()
                await store.close()

        return {sent.key: sent for sent in asyncio.run(run())}

    def wait(self, hours=2.0):
        """Let so much time pass since what the ledger holds."""
        with sqlite3.connect(self.folder / "study.db") as database:
            database.execute("UPDATE payment SET at = datetime(at, ?)", (f"-{hours} hours",))
        database.close()

    def owed(self):
        async def run():
            store = await self.open()
            left = await store.ledger.owed()
            await store.close()
            return [event.key for event in left]

        return asyncio.run(run())

    def check(self):
        """All is paid, and nothing twice."""
        paid = self.platform.paid()
        assert sorted(paid.values()) == [1, 1, 1], paid
        assert sorted(str(what) for _, what in paid) == ["100", "approved", "approved"]
        assert self.owed() == []


@pytest.fixture
def paid(tmp_path, platform):
    return Paid(tmp_path, platform)


class Scripted(Payer):
    """A client that receives one answer to all payments, and another one to all questions about payments."""

    def __init__(self, to_payments, to_questions):
        self.to_payments, self.to_questions, self.payments = to_payments, to_questions, 0

    async def send(self, _):
        self.payments += 1
        return self._answer(self.to_payments)

    async def find(self, _):
        return self._answer(self.to_questions)

    def _answer(self, answer):
        if isinstance(answer, Exception):
            raise answer
        return answer


@pytest.fixture
def send(tmp_path):
    """Return a function that sends all owed payments with a client, and returns the result of each payment."""
    platform = Prolific()
    platform.name, platform.url = "prolific", "https://platform.example"
    paid = Paid(tmp_path, platform)
    assert main(paid.words) == 0

    async def run(client):
        store = await paid.open()
        results = [(sent.state, sent.text) async for sent in Sender("paid", store, client).send()]
        await store.close()
        return results

    def work(client):
        results = asyncio.run(run(client))
        assert len(paid.owed()) == (0 if {state for state, _ in results} == {"paid"} else 3)
        paid.wait()
        return results

    return work


CLOSED = DeclinedError("the submission is closed")
LOST = UnsureError("no answer")
STRANGE = KeyError("status")  # the answer has no such field
STOPPED = StoppedError("no secret")
DOUBT = "the platform did not tell whether it has paid: "


@pytest.mark.parametrize(
    ("to_payments", "to_questions", "result"),
    [
        ("receipt", LOST, ("paid", "receipt")),
        (CLOSED, "approved", ("paid", "approved")),  # the researcher has paid on the platform's own page
        (CLOSED, None, ("refused", "the submission is closed")),
        (CLOSED, LOST, ("refused", "the submission is closed")),
        (CLOSED, STRANGE, ("refused", "the submission is closed")),
        (STOPPED, "approved", ("refused", "no secret")),
        (LOST, "approved", ("in doubt", "no answer")),
        (STRANGE, "approved", ("in doubt", "the platform's answer is not understood: KeyError('status')")),
    ],
)
def test_a_payment_is_refused_only_if_the_platform_has_not_made_it(send, to_payments, to_questions, result):
    assert send(Scripted(to_payments, to_questions)) == [result] * (1 if to_payments is STOPPED else 3)


@pytest.mark.parametrize(
    ("to_questions", "payments", "result"),
    [
        ("approved", 0, ("paid", "approved, as the platform says")),
        (None, 3, ("paid", "receipt")),
        (CLOSED, 0, ("in doubt", f"{DOUBT}the submission is closed")),
        (STOPPED, 0, ("in doubt", f"{DOUBT}no secret")),
        (LOST, 0, ("in doubt", f"{DOUBT}no answer")),
        (STRANGE, 0, ("in doubt", f"{DOUBT}the platform's answer is not understood: KeyError('status')")),
    ],
)
def test_a_payment_in_doubt_is_sent_again_only_if_the_platform_has_not_made_it(
    send, to_questions, payments, result
):
    assert send(Scripted(LOST, LOST)) == [("in doubt", "no answer")] * 3
    client = Scripted("receipt", to_questions)
    assert send(client) == [result] * (1 if to_questions is STOPPED else 3)
    assert client.payments == payments


def test_what_is_owed_is_paid_once(paid, capsys):
    assert main([*paid.words, "--dry-run"]) == 0
    assert paid.platform.asked == [] and paid.owed() == []
    assert main([*paid.words, "--send"]) == 0
    text = capsys.readouterr().out
    assert "p00001-bonus  1.00 USD  put everything away  owed" in text and text.endswith("all is paid\n")
    paid.check()
    asked = len(paid.platform.asked)
    assert main([*paid.words, "--send"]) == 0
    assert len(paid.platform.asked) == asked
    paid.check()
    ids = [value for name in (1, 2) for value in paid.platform.add(name).values() if "0000" in value]
    assert not any(value in text for value in ids)


@pytest.mark.parametrize(
    "fault", [f"{what} {when}" for what in ("500", "hang", "garbage") for when in ("before", "after")]
)
def test_a_platform_in_trouble_pays_once(paid, fault):
    assert main(paid.words) == 0
    paid.platform.faults.extend([fault] * 3)
    first = paid.send()
    assert {key: sent.state for key, sent in first.items()} == dict.fromkeys(paid.owed(), "in doubt")
    assert len(first) == 3
    paid.wait(hours=0.9 if paid.platform.name == "prolific" else 0.15)  # before the platform lists payments
    again = paid.send()
    assert {key: sent.state for key, sent in again.items()} == dict.fromkeys(first, "in doubt")
    paid.wait()
    before = paid.platform.moves
    assert {key: sent.state for key, sent in paid.send().items()} == dict.fromkeys(first, "paid")
    assert paid.platform.moves - before == (0 if fault.endswith("after") else 3), "only what it lacks is sent"
    paid.check()


def test_two_processes_that_send_at_the_same_time_pay_once(paid):
    """The second process sends all other payments while the first process sends the first payment."""

    async def run():
        store, clients = await paid.open(), [payer(paid.study.settings) for _ in range(2)]
        one, other = (Sender("paid", store, client).send() for client in clients)
        sent = [await anext(one), *[result async for result in other], *[result async for result in one]]
        for client in clients:
            await client.close()
        await store.close()
        return [(result.key, result.state) for result in sent]

    assert main(paid.words) == 0
    owed = paid.owed()
    assert sorted(asyncio.run(run())) == sorted((key, "paid") for key in owed)
    paid.check()


@pytest.mark.parametrize("doubtful", range(3))
def test_a_bonus_in_doubt_is_told_from_other_bonuses(paid, doubtful):
    assert main(paid.words) == 0
    for person, amount in (("p00001", "0.70"), ("p00002", "1.30")):
        assert main([*paid.words, "--grant", person, amount, "--reason", "a question was missing"]) == 0
    bonuses = [key for key in paid.owed() if "reward" not in key]
    assert len(bonuses) == 3
    faults = ["500 after" if key in bonuses[doubtful:][:1] else "" for key in paid.owed()]
    paid.platform.faults.extend(faults)
    paid.send()
    assert paid.owed() == bonuses[doubtful:][:1]
    paid.wait()
    paid.send()
    amounts = Counter(what for _, what in paid.platform.paid().elements())
    assert amounts == Counter({"approved": 2, 100: 1, 70: 1, 130: 1}) and paid.owed() == []


def test_a_platform_that_is_asked_too_fast_or_says_no(paid):
    assert main(paid.words) == 0
    paid.platform.faults.extend(["429", "429", "refuse"])
    first = paid.send()
    assert sorted(sent.state for sent in first.values()) == ["paid", "paid", "refused"]
    assert "no money" in next(sent.text for sent in first.values() if sent.state == "refused")
    paid.platform.faults.extend(["429"] * TRIES)
    assert [sent.state for sent in paid.send().values()] == ["refused"]
    assert [sent.state for sent in paid.send().values()] == ["paid"]
    paid.check()


def test_nobody_is_asked_twice_where_the_secret_is_wrong_or_nobody_answers(paid, monkeypatch):
    assert main(paid.words) == 0
    monkeypatch.setenv(paid.platform.variable, "another")
    (sent,) = paid.send().values()
    assert (sent.state, sent.stops) == ("refused", True) and "rejects this secret" in sent.text
    for unusable in ("", "a\nb", "é"):
        monkeypatch.setenv(paid.platform.variable, unusable)
        assert main([*paid.words, "--send"]) == 2
    monkeypatch.setenv(paid.platform.variable, SECRET)
    settings, url = paid.study.settings, "http://127.0.0.1:9"
    recruitment = msgspec.structs.replace(settings.recruitment, api_url=url)
    with_url = msgspec.structs.replace(settings, recruitment=recruitment)
    study, paid.study = paid.study, dataclasses.replace(paid.study, settings=with_url)
    (sent,) = paid.send().values()
    assert (sent.state, sent.stops) == ("refused", True) and "cannot be reached" in sent.text
    paid.study = study
    paid.send()
    paid.check()


def test_somebody_is_rejected_instead_of_paid(paid, capsys):
    reason = "The same key was held down from the beginning to the end; nobody can have looked at the list of tasks so."
    assert main([*paid.words, "--reject", "p00002", "--reason", reason]) == 0
    assert main([*paid.words, "--send"]) == 0
    assert "p00002-reward" not in capsys.readouterr().out
    assert sorted(str(what) for _, what in paid.platform.paid()) == ["100", "approved"]
    assert paid.owed() == []
    assert main([*paid.words, "--reject", "p00001", "--reason", reason]) == 2, "it was paid"
    assert main([*paid.words, "--reject", "p00001"]) == 2
    assert main([*paid.words, "--send", "--dry-run"]) == 2


def test_who_leaves_early_gets_what_the_rules_say(paid):
    before = {"prolific": ("SCREENED OUT", "RETURNED", "TIMED-OUT")}
    ends = before.get(
        paid.platform.name, ("Pending",) * 3 if paid.platform.name == "connect" else ("Accepted",) * 3
    )
    ids = [paid.platform.add(number, end) for number, end in enumerate(ends, 3)]
    paid.leave(3, ids[0], "device", "screened_out")
    paid.leave(4, ids[1], "survey", "withdrawn")
    paid.leave(5, ids[2], "survey", "timed_out")
    assert main([*paid.words, "--send"]) == (1 if paid.platform.name == "external-question" else 0)
    amounts = sorted(str(what) for _, what in paid.platform.paid())
    usual = ["100", "approved", "approved"]
    assert (
        amounts
        == {
            "prolific": sorted(
                [*usual, "525", "525"]
            ),  # the platform has paid who was screened out by itself
            "connect": sorted([*usual, "50", "525", "525"]),
            "external-question": usual,  # no assignment was submitted for which it pays
        }[paid.platform.name]
    )
    left = ["p00003-screen_out", "p00004-partial", "p00005-partial"]
    assert sorted(paid.owed()) == (left if paid.platform.name == "external-question" else [])


# Runs `mjsim study pay --send`, and kills itself at a point that its last word names.
KILLED = """
import os, signal, sys
from experiments.cli.main import main
from experiments.study.recruitment import connect, external_question, prolific
from experiments.visit.store.ledger import Ledger

def die(function, when):
    async def run(self, *words, **names):
        if when == "before":
            os.kill(os.getpid(), signal.SIGKILL)
        result = await function(self, *words, **names)
        os.kill(os.getpid(), signal.SIGKILL)
    return run

owner, name, when = sys.argv.pop().split()
payers = (prolific.ProlificPayer, connect.ConnectPayer, external_question.ExternalQuestionPayer)
for one in (Ledger,) if owner == "ledger" else payers:
    setattr(one, name, die(getattr(one, name), when))
sys.exit(main(sys.argv[1:]))
"""
POINTS = [
    f"{what} {when}"
    for what in (
        "ledger decide",
        "ledger begin_sending",
        "payer find",
        "ledger fail",
        "payer send",
        "ledger confirm",
    )
    for when in ("before", "after")
]  # each leaves what the next one needs


@pytest.mark.slow
@pytest.mark.parametrize(
    "platform", PLATFORMS if "MJSIM_FAULTS" in os.environ else ["prolific"], indirect=True
)
def test_a_kill_at_any_point_pays_once(paid):
    for point in POINTS:
        words = [sys.executable, "-c", KILLED, *paid.words, "--send", point]
        assert subprocess.run(words, check=False).returncode == -signal.SIGKILL, point
        paid.wait()
    assert main([*paid.words, "--send"]) == 0
    paid.check()


@pytest.mark.slow
@pytest.mark.parametrize("platform", ["prolific"], indirect=True)
@pytest.mark.parametrize("when", ["before", "after"])
def test_a_kill_while_the_platform_answers_pays_once(paid, when):
    assert main(paid.words) == 0
    for _ in range(3):
        if not paid.owed():
            break
        paid.platform.stuck.clear()
        paid.platform.faults.append(f"hang {when}")
        process = subprocess.Popen([sys.executable, "-m", "mjsim", *paid.words, "--send"], env=os.environ)
        until = time.monotonic() + PATIENCE
        while not paid.platform.stuck.wait(0.1) and process.poll() is None:
            assert time.monotonic() < until
        process.kill()
        process.wait()
        paid.platform.faults.clear()
        paid.wait()
    assert main([*paid.words, "--send"]) == 0
    paid.check()


def test_settings_of_a_platform_are_named_with_their_line(tmp_path):
    for before, after, line, text in (
        ('completed = "C0MPLETE"', 'completed = "a b"', "completed", "completed"),
        ('sites = ["https://site"]', 'sites = ["site; *"]', "sites", "sites"),
        ('api_url = "https://site"', 'api_url = "http://site"', "api_url", "http://site"),
        ('api_url = "https://site"', 'api_url = "site"', "api_url", "'site'"),
    ):
        content = STUDY.format(platform="prolific", url="https://site").replace(before, after)
        (tmp_path / "study.toml").write_text(content)
        number = next(i for i, row in enumerate(content.splitlines(), 1) if row.startswith(line))
        with pytest.raises(Exception, match=f"line {number}: .*{text}"):
            read_people_study(tmp_path / "study.toml")


def test_a_platform_that_pays_dollars_pays_nothing_else(paid, capsys):
    file = paid.file.read_text().replace("[study.pay]", '[study.pay]\ncurrency = "EUR"')
    paid.file.write_text(file)
    dollars = paid.platform.name != "prolific"  # where the currency is that of the platform's study
    assert main([*paid.words, "--send"]) == (2 if dollars else 0)
    assert ("pays in USD" in capsys.readouterr().err) is dollars
