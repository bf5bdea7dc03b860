"""Who gets what: by rule, noted once, paid once."""

import asyncio
import dataclasses
from datetime import UTC, datetime

import msgspec
import pytest

from experiments.cli.main import main
from experiments.study.file import Pay, read_people_study
from experiments.study.payments.rules import decide, due
from experiments.trials.designs import FOLDER
from experiments.visit.store import PersonRow, Store

PAY = Pay(currency="EUR", reward=7.5, screen_out=0.51, bonus_for_all=1.0, partial=True)


def with_pay(pay):
    study = read_people_study(FOLDER / "paper.toml")
    return dataclasses.replace(study, settings=msgspec.structs.replace(study.settings, pay=pay))


async def fill(store):
    """People who end in every way; the first one put everything away."""
    ends = (("task", "finished"), ("task", "finished"), ("device", "screened_out"), ("consent", "no_consent"))
    for number, (phase, status) in enumerate(
        (*ends, ("survey", "withdrawn"), ("story", "withdrawn"), ("task", None))
    ):
        person = await store.arrive("link", None, {}, f"{number:064}", phase)
        if number == 0:
            await store.finish_trial(person.id, "task", "x", "all delivered")
        if status == "finished":
            await store.finish_phase(person.id, phase, "completion", {}, status=status)
        elif status:
            await store.finish_phase(person.id, person.phase, person.phase, status=status)


async def end_in(store, phase, status):
    person = await store.arrive("link", None, {}, f"{phase}-{status}".ljust(64), phase)
    await store.finish_phase(person.id, person.phase, person.phase, status=status)
    return person


@pytest.mark.parametrize("partial", [True, False])
def test_work_that_was_done_is_paid_however_it_ended(tmp_path, partial):
    async def run():
        store = await Store.open(f"sqlite:///{tmp_path / 'study.db'}", "study", "0" * 64)
        for phase, status in (
            ("comprehension", "screened_out"),
            ("survey", "screened_out"),
            ("debriefing", "timed_out"),
            ("debriefing", "withdrawn"),
        ):
            await end_in(store, phase, status)
        payments = due(with_pay(pay), await store.people(), ())
        await store.close()
        return {payment.key: payment.cents for payment in payments}

    pay = Pay(reward=10.0, screen_out=1.0, partial=partial)
    assert asyncio.run(run()) == {
        "p00001-screen_out": 100,
        "p00002-screen_out": 100,
        "p00002-bonus": 600,  # 7 of 10 phases, together
        "p00003-reward": 1000,
        "p00004-reward": 1000,
    }


@pytest.mark.parametrize(
    ("phase", "status", "reasons"),
    [
        ("device", "screened_out", {"screen_out": "screened out by device"}),
        (
            "task",
            "screened_out",
            {"screen_out": "no place was left", "bonus": "no place was left after 6 of 10 phases"},
        ),
        ("survey", "withdrawn", {"partial": "left after 7 of 10 phases"}),
        ("survey", "timed_out", {"partial": "did not return after 7 of 10 phases"}),
        ("debriefing", "timed_out", {"reward": "finished the study"}),
    ],
)
def test_the_reason_of_a_payment_says_how_the_participation_ended(phase, status, reasons):
    now = datetime(2026, 5, 1, 12, tzinfo=UTC)
    person = PersonRow(1, "0" * 64, "link", status, phase, now, now, delete_wanted=False)
    assert {payment.kind: payment.why for payment in due(with_pay(PAY), [person], ())} == reasons


def granted(folder, *words):
    return main(["study", "pay", str(folder / "study.toml"), str(folder), "--grant", *words])


def test_a_payment_outside_the_rules_is_owed_once_and_audited(tmp_path, capsys):
    study = tmp_path / "study.toml"
    assert main(["study", "init", str(study)]) == 0
    read = read_people_study(study)

    async def ask(work):
        store = await Store.open(f"sqlite:///{tmp_path / 'study.db'}", read.settings.name, read.sha256)
        found = await work(store)
        await store.close()
        return found

    async def history(store):
        return await store.ledger.history(), await store.audit_log()

    asyncio.run(ask(fill))
    assert granted(tmp_path, "p00004", "2.50", "--reason", "the server failed") == 0
    assert "\np00004-grant-1  2.50 USD  the server failed  owed\n" in capsys.readouterr().out
    for words in (
        ("2.50", "--reason", "the server failed"),
        ("0",),
        ("-1", "--reason", "x"),
        ("1.234", "--reason", "x"),
    ):
        assert granted(tmp_path, "p00004", *words) == 2
    assert granted(tmp_path, "p00099", "1", "--reason", "x") == 2
    assert "is the same amount for the same reason" in capsys.readouterr().err
    assert granted(tmp_path, "p00004", "1", "--reason", "waited for long") == 0
    events, log = asyncio.run(ask(history))
    assert [(one.key, one.kind, one.cents, one.note) for one in events] == [
        ("p00004-grant-1", "bonus", 250, "the server failed"),
        ("p00004-grant-2", "bonus", 100, "waited for long"),
    ]
    found = [row.details for row in log if row.action == "payment granted"]
    assert [(one["person"], one["cents"], one["reason"]) for one in found] == [
        (4, 250, "the server failed"), (4, 100, "waited for long"),
    ]  # fmt: skip
    capsys.readouterr()
    assert main(["study", "pay", str(study), str(tmp_path), "--dry-run"]) == 0
    assert "p00004-grant-1  2.50 USD  the server failed  owed" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("pay", "expected"),
    [
        (
            PAY,
            {
                "p00001-reward": 750,
                "p00001-bonus": 100,
                "p00002-reward": 750,
                "p00003-screen_out": 51,  # half a cent rounds up
                "p00005-partial": 525,  # 7 of 10 phases
            },
        ),
        (Pay(reward=2.0), {"p00001-reward": 200, "p00002-reward": 200}),
        (Pay(), {}),
    ],
)
def test_rules_say_who_gets_what_and_deciding_again_changes_nothing(tmp_path, pay, expected):
    async def run():
        store = await Store.open(f"sqlite:///{tmp_path / 'study.db'}", "study", "0" * 64)
        await fill(store)
        payments = due(with_pay(pay), await store.people(), await store.trials())
        first, again = await decide(store, payments), await decide(store, payments)
        owed = await store.ledger.owed()
        await store.close()
        return payments, first, again, owed

    payments, first, again, owed = asyncio.run(run())
    assert {payment.key: payment.cents for payment in payments} == expected
    assert (first, again, len(owed)) == (len(expected), 0, len(expected))


def test_a_payment_is_noted_once(tmp_path, capsys):
    study = tmp_path / "study.toml"
    assert main(["study", "init", str(study)]) == 0

    async def prepare():
        read = read_people_study(study)
        store = await Store.open(f"sqlite:///{tmp_path / 'study.db'}", read.settings.name, read.sha256)
        await fill(store)
        await store.close()

    asyncio.run(prepare())
    words = ["study", "pay", str(study), str(tmp_path)]
    assert main([*words, "--dry-run"]) == 0
    paid = [*words, "--without-rehearsal", "--paid", "p00001-reward", "--reference", "receipt 1"]
    assert main(paid) == 2, "the dry run decided nothing"
    assert main(words) == 0
    assert main(paid) == 0
    assert main(paid) == 2
    assert main([*words, "--paid", "p00001-reward"]) == 2
    capsys.readouterr()
    assert main(words) == 0
    text = capsys.readouterr().out
    assert "p00001-reward  7.50 USD  finished the study  paid" in text
    assert "p00002-reward  7.50 USD  finished the study  owed" in text
    assert "7.50 USD are owed" in text
