"""`mjsim study reconcile`: who has invented ids is marked in the table, and a rule of exclusion leaves them out."""

import asyncio

import pytest

from experiments.cli.main import main
from experiments.study.data.collect import collect
from experiments.study.file import read_people_study
from experiments.trials.exclusions import Exclusions, Rule, left_out
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from experiments.visit.store import Store

STUDY = """
[[cells]]
assistance = "optimal"
objects = 1
people = 4

[study]
name = "small"
title = "A small study"
institution = "a test"
contact = "nobody@example.org"
[study.recruitment]
platform = "prolific"
completed = "C1"
screened_out = "C2"
no_consent = "C3"
"""
LIST = "\ufeffSubmission id;Participant id\r\nsubmission0001,person000001\r\nsubmission0002,person000002\n"
ARRIVED = (
    (1, 1),
    (2, 2),
    (3, 3),
    (1, 2),
)  # numbers in the ids of person and submission; the list has the first two


@pytest.fixture
def served(tmp_path, house, monkeypatch):
    """A study in which four people have played, and the list of its platform, in the current folder."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text(STUDY)
    (tmp_path / "list.csv").write_text(LIST, encoding="utf-8")
    brief = TrialConfig(objects=1, assistance="optimal", seed=0, fidelity="event", regret=False)
    run_trial(brief, tmp_path / "out" / "run", topdown=False, house=house)
    study = read_people_study(tmp_path / "s.toml")

    async def play(store):
        for number, (person, submission) in enumerate(ARRIVED):
            ids = {"PROLIFIC_PID": f"person{person:06d}", "SESSION_ID": f"submission{submission:04d}"}
            row = await store.arrive("prolific", f"key{number}", ids, f"{number}" * 64, "task")
            await store.finish_trial(row.id, "task", "run", "all delivered")

    with_store(study, tmp_path, play, create=True)
    return study


def with_store(study, folder, work, **settings):
    async def opened():
        url = f"sqlite:///{folder / 'out' / 'study.db'}"
        store = await Store.open(url, "small", study.sha256, **settings)
        try:
            return await work(store)
        finally:
            await store.close()

    return asyncio.run(opened())


def test_invented_ids_are_marked_and_left_out(served, tmp_path, capsys):
    for newer, unknown in (("", [3, 4]), ("submission0003,person000003\n", [4])):
        (tmp_path / "list.csv").write_text(LIST + newer, encoding="utf-8")
        assert main(["study", "reconcile", "s.toml", "out", "list.csv", "--who", "ada"]) == 0
        names = [f"p{number:05d}" for number in unknown]
        assert f"unknown: {', '.join(names)}\n" in capsys.readouterr().out
        rows = with_store(served, tmp_path, lambda store: collect(served, store, tmp_path / "out")).rows
        assert [row["recruitment_known"] for row in rows] == [k not in unknown for k in (1, 2, 3, 4)]
        rule = Rule("recruitment_known", "==", "not known to the platform", False)
        gone = left_out(Exclusions((rule,)), rows, tmp_path)
        assert [(one.person, *one.rules.values()) for one in gone.values()] == [
            (name, "not known to the platform") for name in names
        ]
    *_, entry = with_store(served, tmp_path, Store.audit_log)
    assert (entry.who, entry.action, entry.details) == ("ada", "participants reconciled", {"unknown": [4]})


@pytest.mark.parametrize(
    ("text", "settings", "told"),
    [
        ("Submission id\nsubmission0009,person000001\n", STUDY, "lists none of the 4 participants"),
        ("", STUDY, "lists none of the 4 participants"),
        (LIST, STUDY.replace('"prolific"', '"link"'), "has no list of submissions"),
    ],
)
@pytest.mark.usefixtures("served")
def test_a_wrong_list_marks_nobody(text, settings, told, tmp_path, capsys):
    (tmp_path / "list.csv").write_text(text, encoding="utf-8")
    (tmp_path / "s.toml").write_text(settings)
    assert main(["study", "reconcile", "s.toml", "out", "list.csv"]) != 0
    assert told in capsys.readouterr().err
    study = read_people_study(tmp_path / "s.toml")
    assert with_store(study, tmp_path, Store.answers) == ()
