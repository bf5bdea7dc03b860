"""Rehearsals: a seed plans the same people, a small study passes, is continued, and is kept apart from people."""

import asyncio
import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter

import numpy as np
import pytest
from check_rehearsal import check

from experiments.cli.main import main, parser
from experiments.record.phases import REHEARSED
from experiments.session.video import VideoWriter
from experiments.study.file import read_people_study
from experiments.study.rehearsal.plan import plan_people
from experiments.study.rehearsal.report import report
from experiments.study.rehearsal.run import RehearsalSettings, rehearse
from experiments.visit.plan import PHASES
from experiments.visit.store import Store

STUDY = """
[all_cells]
user = "guest"
fidelity = "event"
regret = false
house_seeds = 57

[[cells]]
assistance = "optimal"
objects = 1
people = 4

[[cells]]
assistance = "none"
objects = 1
seeds = "20:24"

[study]
name = "small"
title = "Tidying up"
institution = "an institution"
contact = "you@example.org"
phases = ["consent", "device", "story", "comprehension", "training", "task", "survey", "completion"]

[study.minimum]
story = 10

[study.pay]
reward = 7.5

[study.recruitment]
platform = "prolific"
completed = "CODE1"
screened_out = "CODE2"
no_consent = "CODE3"
"""
PATIENCE = 120.0  # s


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    return path


def ended(out):
    """Numbers of the people whose end is noted."""
    path = out / "people.jsonl"
    lines = path.read_text().splitlines() if path.is_file() else []
    return [one["number"] for one in map(json.loads, lines) if one["outcome"]]


def test_a_seed_plans_the_same_people_with_the_shares_that_are_wanted():
    first, again = (plan_people(PHASES, 2000, 7, per_minute=2.0, dropouts=0.2) for _ in range(2))
    assert first == again
    assert first != plan_people(PHASES, 2000, 8, per_minute=2.0, dropouts=0.2)
    leave, back = (
        np.mean([value is not None for value in values])
        for values in zip(*((one.leaves, one.returns_in) for one in first), strict=True)
    )
    assert abs(leave - 0.2) < 0.03 and abs(back - 0.1) < 0.02
    assert abs(first[-1].arrives / 2000 - 30.0) < 3.0
    assert {one.leaves_in for one in first if one.leaves} == set(PHASES[:-1])


def test_nobody_is_paid_before_a_rehearsal_has_passed(tmp_path, study, capsys):
    served, out = tmp_path / "served", tmp_path / "rehearsal"
    served.mkdir()
    out.mkdir()
    add = ["study", "researcher", "add", str(study), str(served), "ada", "--role", "owner", "--generate"]
    assert main(add) == 0, "this makes the database"
    sha = hashlib.sha256(study.read_bytes()).hexdigest()
    words = ["study", "pay", str(study), str(served), "--database", f"sqlite:///{served}/study.db"]
    paid = [*words, "--paid", "p00001-reward", "--reference", "receipt"]
    assert main(paid) == 2 and "study rehearse" in capsys.readouterr().err
    for hashed, passed, said in ((sha[::-1], True, "another study file"), (sha, False, "went wrong")):
        report = {"settings": {"study": hashed, "people": 6}, "passed": passed}
        (out / "rehearsal.json").write_text(json.dumps(report))
        assert main([*paid, "--rehearsal", str(out)]) == 2
        assert said in capsys.readouterr().err
    (out / "rehearsal.json").write_text(json.dumps({**report, "passed": True}))
    for further in (["--rehearsal", str(out)], []):  # it is asked for once
        assert main([*paid, *further]) == 2
        assert "p00001-reward" in capsys.readouterr().err


async def _empty_rehearsal(study, out):
    store = await Store.open(f"sqlite:///{out / 'study.db'}", study.settings.name, study.sha256)
    try:
        return await report(study, RehearsalSettings(study.sha256, 1, 0, 2.0, 0.2, 20.0), store, [], out)
    finally:
        await store.close()


def test_a_rehearsal_that_cannot_be_analysed_has_not_passed(tmp_path, study):
    found = asyncio.run(_empty_rehearsal(read_people_study(study), tmp_path))
    assert not found.passed and found.faults[0].startswith("the analysis cannot be computed: ")
    assert json.loads((tmp_path / "rehearsal.json").read_text())["passed"] is False


def test_a_rehearsal_is_never_written_to_the_real_database(tmp_path, study, monkeypatch):
    """Otherwise simulated people would take the places of participants."""
    monkeypatch.setenv("MJSIM_STUDY_DATABASE", "postgresql://real@example.org/study")
    started = []

    async def noted(*command, **_):
        started.extend(command)
        raise ProcessLookupError

    monkeypatch.setattr(asyncio, "create_subprocess_exec", noted)
    read = read_people_study(study)
    settings = RehearsalSettings(read.sha256, people=1, seed=0, per_minute=2.0, dropouts=0.2, factor=20.0)
    with pytest.raises(ProcessLookupError):
        asyncio.run(rehearse(read, settings, tmp_path / "out", None, lambda _: None))
    arguments = parser("study").parse_args(started[started.index("study") :])
    assert arguments.database == f"sqlite:///{tmp_path}/out/served/study.db"


def test_another_study_or_folder_is_not_opened_as_an_empty_study(tmp_path, study, capsys):
    served = tmp_path / "served"
    add = ["study", "researcher", "add", str(study), str(served), "ada", "--role", "owner", "--generate"]
    assert main(add) == 0
    other = tmp_path / "other.toml"
    other.write_text(STUDY.replace('name = "small"', 'name = "other"'))
    for words in (["pay", "--dry-run"], ["hosts"], ["collect", "--out", str(tmp_path / "table")]):
        assert main(["study", words[0], str(other), str(served), *words[1:]]) == 2, words
        assert "has no study 'other' (it has: small)" in capsys.readouterr().err
    film = tmp_path / "film.mp4"
    with VideoWriter(film, width=64, height=48) as writer:
        writer.write(np.zeros((48, 64, 3), np.uint8))
    words = ["serve", str(other), "--out", str(served), "--port", "0", "--no-open", "--film", str(film)]
    assert main(["study", *words]) == 2, "a folder holds one study"
    assert "it has: small" in capsys.readouterr().err
    assert main(["play", "--port", "0", "--no-open", "--out", str(served)]) == 2
    assert "it has: small" in capsys.readouterr().err
    assert main(["study", "researcher", "list", str(study), str(tmp_path / "typo")]) == 2
    assert main(["study", "researcher", "list", str(study), str(served), "ada"]) == 2
    assert "leave out 'ada'" in capsys.readouterr().err
    (tmp_path / "empty.db").touch()
    for database in (str(tmp_path / "new.db"), "ada:hunter2@host/x"):
        assert main(["study", "restore", str(tmp_path / "empty.db"), database]) == 2
    assert "hunter2" not in (told := capsys.readouterr().err) and str(tmp_path / "empty.db") in told
    assert not (tmp_path / "typo").exists() and not (tmp_path / "new.db").exists()


@pytest.mark.slow
def test_a_small_study_is_rehearsed_continued_and_consistent(tmp_path, study, capsys):
    out = tmp_path / "rehearsal"
    words = ["study", "rehearse", str(study), "--people", "6", "--seed", "0", "--dropouts", "0.4"]
    words += ["--per-minute", "8", "--out", str(out)]
    command = [sys.executable, "-m", "experiments.cli.main", *words]
    first = subprocess.Popen(command, env=os.environ, stderr=subprocess.PIPE, text=True)
    until = time.monotonic() + PATIENCE
    while not ended(out) and first.poll() is None:
        assert time.monotonic() < until
        time.sleep(0.1)
    first.send_signal(signal.SIGTERM)
    _, said = first.communicate(timeout=PATIENCE)
    assert first.returncode == 128 + signal.SIGTERM
    assert said.splitlines()[-1] == "mjsim: stopped by SIGTERM. Finished work is kept"
    assert "Traceback" not in said
    before = ended(out)
    assert main(words) == 0, (out / "rehearsal.json").read_text()
    assert Counter(ended(out)) == dict.fromkeys(range(6), 1) and ended(out)[: len(before)] == before
    wrong, numbers = check(out)
    assert wrong == []
    assert numbers["people"] == 6 and set(numbers["statuses"]) > {"finished"}
    assert REHEARSED in (out / "analysis" / "report.html").read_text()
    served = str(out / "served")
    capsys.readouterr()
    assert main(["study", "collect", str(study), served, "--out", str(tmp_path / "table")]) == 2
    assert "rehearsal" in capsys.readouterr().err
    assert main(["study", "pay", str(study), served, "--paid", "p00001-reward", "--reference", "x"]) == 2
