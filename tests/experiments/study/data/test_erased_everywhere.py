"""A person who is erased is in no file that the study wrote: every value is searched in every byte, decompressed."""

import asyncio
import datetime
import gzip
import json
import os
import shutil
import sqlite3
import tempfile
import zipfile
from contextlib import closing

import numpy as np
import pyarrow.parquet
import pytest
from store_clock import at

from experiments.cli.main import main
from experiments.study.file import read_people_study
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from experiments.visit.store import Store
from mjsim.support.files import WORK

pytestmark = pytest.mark.slow
PEOPLE = ("anna", "bert", "cleo")
SEEDS = (6112233, 6445566, 6778899)  # of people; no other number in the files is one of these


def day(name):
    """The day on which a person took part."""
    return datetime.datetime(2041 + PEOPLE.index(name), 5, 17, 11, 13, 19, 271828, datetime.UTC)


def values_of(name):
    """Everything that is this person's alone."""
    number = PEOPLE.index(name) + 1
    texts = ("PID", "SUBMISSION", "key", "draft", "wrote", "age", "receipt", "reason", "code", "journal")
    return (
        f"p{number:05d}", f"{number}" * 64, str(SEEDS[number - 1]), day(name).strftime("%Y-%m-%d"),
        *(f"{name}-{text}" for text in texts),
    )  # fmt: skip


def contents(path):
    """Forms of the content of a file: its bytes, and the values in it that are compressed or binary."""
    raw = path.read_bytes()
    yield raw
    if raw.startswith(b"\x1f\x8b"):
        yield gzip.decompress(raw)
    if raw.startswith(b"PK\x03\x04"):
        with zipfile.ZipFile(path) as archive:
            yield from (archive.read(name) for name in archive.namelist())
        if path.suffix == ".npz":
            arrays = np.load(path)
            yield from (str(arrays[name].tolist()).encode() for name in arrays.files)
    if raw.startswith(b"PAR1"):
        yield json.dumps(pyarrow.parquet.read_table(path).to_pylist(), default=str).encode()
    if raw.startswith(b"SQLite format 3"):
        with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as database:
            yield "\n".join(database.iterdump()).encode()


def traces(folder, values):
    """Where any of the values is, in a name or in a content."""
    found = []
    for path in (path for path in folder.rglob("*") if path.is_file()):
        texts = [str(path.relative_to(folder)).encode(), *contents(path)]
        found += [(str(path.relative_to(folder)), v) for v in values if any(v.encode() in t for t in texts)]
    return found


@pytest.fixture(scope="module")
def runs(tmp_path_factory, house):
    folder = tmp_path_factory.mktemp("runs")
    for name, seed in zip(PEOPLE, SEEDS, strict=True):
        seeds = {"house_seed": 0, "person_seed": seed, "order_seed": seed}
        config = TrialConfig(objects=1, assistance="optimal", fidelity="event", regret=False, **seeds)
        run_trial(config, folder / name, topdown=False, house=house)
    return folder


async def _fill(study, folder, runs):
    store = await Store.open(f"sqlite:///{folder}/study.db", study.settings.name, study.sha256)
    for number, name in enumerate(PEOPLE, 1):
        with at(day(name)):
            await _take_part(store, folder, runs, number, name)
    await store.close()


async def _take_part(store, folder, runs, number, name):
    ids, token = {"PROLIFIC_PID": f"{name}-PID", "SESSION_ID": f"{name}-SUBMISSION"}, f"{number}" * 64
    person = await store.arrive("prolific", f"{name}-key", ids, token, "consent")
    await store.show_phase(person.id, "consent")
    await store.finish_phase(person.id, "consent", "task", {"agreed": True, "code": f"{name}-code"})
    visit = folder / "visits" / token
    shutil.copytree(runs / name, visit / "task")
    (visit / "visit.json").write_text(json.dumps({"phase": "result", "seed": SEEDS[number - 1]}))
    (visit / "journals" / "training").mkdir(parents=True)
    (visit / "journals" / "training" / "journal.bin").write_bytes(f"{name}-journal".encode())
    await store.finish_trial(person.id, "task", f"visits/{token}/task", "all delivered")
    await store.finish_phase(person.id, "task", "survey", {}, "all delivered")
    for draft in range(20):
        await store.save_answers(person.id, "survey", {"comments": f"{name}-draft {draft} " * 40})
    answers = {"comments": f"{name}-wrote", "age": f"{name}-age"}
    await store.finish_phase(person.id, "survey", "completion", answers, status="finished")
    for kind in ("reward", "bonus"):
        key = f"p{number:05d}-{kind}"
        await store.ledger.decide(person.id, kind, 750, "USD", key, f"{name}-reason")
        attempt = await store.ledger.begin_sending(key)
        await store.ledger.confirm(key, attempt, f"{name}-receipt")


@pytest.fixture
def served(tmp_path, runs, monkeypatch):
    """A study of which everything was made that can be made: in its folder, in others, and of what was made."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    study, folder = tmp_path / "study.toml", tmp_path / "served"
    assert main(["study", "init", str(study)]) == 0
    study.write_text(study.read_text().replace("attempts = 3 ", "keep_days = 30\nattempts = 3 "))
    folder.mkdir()
    asyncio.run(_fill(read_people_study(study), folder, runs))
    names, run = [str(study), str(folder)], folder / "visits" / ("2" * 64) / "task"
    (folder / "again").mkdir()
    for place in (tmp_path, folder):  # what killed commands have left
        (left := place / f"{WORK}99999999-killed").mkdir()
        (left / "texts.csv").write_text("bert-wrote")
        for path in (left / "texts.csv", left):
            os.utime(path, (0, 0))
    for words in (
        ["study", "backup", *names, "--out", tmp_path / "backup.db"],
        ["study", "backup", *names, "--out", folder / "backup.db"],
        ["study", "restore", folder / "backup.db", tmp_path / "restored.db"],
        ["study", "restore", tmp_path / "backup.db", folder / "again" / "study.db"],
        ["study", "collect", *names, "--out", tmp_path / "table"],
        ["study", "collect", *names, "--out", folder / "table"],
        ["study", "collect", str(study), folder / "visits", "--out", tmp_path / "visits-table"],
        ["study", "export", *names, "--out", tmp_path / "export"],
        [
            "metrics",
            tmp_path / "export" / "runs" / "p00002" / "task",
            "--out",
            tmp_path / "exported-run.json",
        ],
        ["study", "export", *names, "--out", tmp_path / "export", "--force"],
        ["study", "analyze", tmp_path / "table"],
        ["study", "analyze", tmp_path / "table", "--out", tmp_path / "analysis of the table"],
        ["study", "analyze", folder / "table", "--out", tmp_path / "another analysis"],
        ["study", "analyze", folder],
        ["metrics", run, "--out", tmp_path / "run.csv"],
        ["metrics", folder / "visits", "--out", tmp_path / "runs.csv"],
        ["view", run, "--out", tmp_path / "page.html"],
        ["replay", run, "--video", tmp_path / "film.mp4", "--size", "320x240", "--from", 5],
    ):
        assert main([str(word) for word in words]) == 0, words
    return names


MADE_OF_BERT = ("exported-run.json", "run.csv", "runs.csv", "page.html", "film.mp4")
ANALYSES = ("table/analysis", "analysis of the table", "another analysis", "served/analysis")
TABLES = ("table", "served/table", "visits-table", "export", "backup.db", "served/backup.db", "restored.db")


def test_a_person_who_is_erased_is_in_no_file_of_the_study(served, tmp_path, capsys):
    before = {name: {path for path, _ in traces(tmp_path, values_of(name))} for name in PEOPLE}
    wanted = {
        "run.csv",
        "runs.csv",
        "table/texts.csv",
        "restored.db",
        "served/again/study.db",
    }
    assert before["bert"] >= {*wanted, "served/study.db", "another analysis/people.parquet"}, (
        "the search finds values"
    )
    capsys.readouterr()
    assert main(["study", "erase", *served, "p00002", "--who", "me"]) == 0
    said = capsys.readouterr().out
    assert traces(tmp_path, values_of("bert")) == []
    for made in MADE_OF_BERT:
        assert not (tmp_path / made).exists() and f"{tmp_path / made} of " in said
    for made in ANALYSES:
        assert not list((tmp_path / made).iterdir()) and f"{tmp_path / made} of " in said
    for made in TABLES:
        assert f"{tmp_path / made} of " in said
    for other in ("anna", "cleo"):
        kept = {path for path, _ in traces(tmp_path, values_of(other))}
        lost = {path.split("/")[-2:][0] for path in before[other] - kept}
        assert kept >= {
            "table/trials.csv",
            "restored.db",
            "served/study.db",
            "export/data/study-mystudy_data.csv",
        }
        assert lost <= {"analysis", "analysis of the table", "another analysis", "runs.csv"}
    assert main(["study", "analyze", str(tmp_path / "table")]) == 0
    assert main(["study", "erase", *served, "p00003", "--who", "me"]) == 0
    assert traces(tmp_path, values_of("cleo")) == []
