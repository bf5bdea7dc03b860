"""An export: tables, runs and a codebook that follow Psych-DS, without any id, link or address of anybody."""

import asyncio
import csv
import dataclasses
import json
import os
import re
import shlex
import shutil
import sqlite3
import subprocess
from contextlib import closing

import pytest

from experiments.cli.main import main
from experiments.study.data.collect import FORMULA
from experiments.study.data.export import export
from experiments.study.file import read_people_study
from experiments.study.recruitment import recruiter
from experiments.study.rehearsal.dry_run import dry_run
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from experiments.visit.store import Store
from experiments.visit.tokens import token_hash
from experiments.web.server.pool import WorkerPool

VALIDATOR = "MJSIM_PSYCHDS_VALIDATOR"  # command of the validator, such as `deno run -A .../src/index.ts`
SECRETS = (
    "MARKED-PID-1",
    "MARKED-SESSION-1",
    "a" * 64,
    "MARKED-KEY-1",
    "MARKED-PID-2",
    "b" * 64,
    "MARKED-KEY-2",
)
HOSTILE = '=HYPERLINK("http://example.org")'


@pytest.fixture(scope="module")
def run(tmp_path_factory, house):
    out = tmp_path_factory.mktemp("runs") / "task"
    run_trial(
        TrialConfig(objects=1, assistance="optimal", seed=0, fidelity="event", regret=False),
        out, topdown=False, house=house,
    )  # fmt: skip
    return out


@pytest.fixture
def served(tmp_path, run):
    """A study that was served: one finished, one does not agree, one left with the data kept, one is deleted."""
    assert main(["study", "init", str(tmp_path / "study.toml")]) == 0
    folder = tmp_path / "served"
    folder.mkdir()
    asyncio.run(_fill(read_people_study(tmp_path / "study.toml"), folder, run))
    return tmp_path / "study.toml", folder


async def _fill(study, folder, run):
    store = await Store.open(f"sqlite:///{folder / 'study.db'}", study.settings.name, study.sha256)
    for number, name in enumerate("abcd", 1):
        ids = {"PROLIFIC_PID": f"MARKED-PID-{number}", "SESSION_ID": f"MARKED-SESSION-{number}"}
        person = await store.arrive("prolific", f"MARKED-KEY-{number}", ids, name * 64, "consent")
        await store.show_phase(person.id, "consent")
        if name == "b":
            await store.finish_phase(person.id, "consent", "consent", {"agreed": False}, status="no_consent")
            continue
        await store.finish_phase(person.id, "consent", "device", {"agreed": True})
        measured = {"frames_per_s": 60.0, "renderer": HOSTILE, "faults": [], "attempts": 2}
        await store.finish_phase(person.id, "device", "task", measured)
        if name == "c":
            await store.withdraw(person.id, delete=False)
            continue
        shutil.copytree(run, folder / "visits" / (name * 64) / "task")
        await store.finish_trial(person.id, "task", f"visits/{name * 64}/task", "all delivered")
        await store.finish_phase(person.id, "task", "survey", {}, "all delivered")
        answers = {"useful": 4, "games": "Every day", "comments": HOSTILE}
        await store.finish_phase(person.id, "survey", "completion", answers, status="finished")
        if name == "d":
            await store.withdraw(person.id, delete=True)
    await store.close()


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_an_export_has_tables_runs_and_a_codebook(served, tmp_path):
    study, folder = served
    out = tmp_path / "export"
    assert main(["study", "export", str(study), str(folder), "--out", str(out)]) == 0
    (row,) = rows_of(out / "data" / "study-mystudy_data.csv")
    assert (row["participant"], row["likert_useful"], row["answer_games"]) == ("p00001", "4", "Every day")
    phases = rows_of(out / "data" / "study-mystudy_description-phases_data.csv")
    assert {row["participant"] for row in phases} == {"p00001", "p00003"}
    assert {(row["phase"], row["attempts"]) for row in phases} >= {("device", "2"), ("consent", "0")}
    answers = rows_of(out / "data" / "study-mystudy_description-answers_data.csv")
    assert {"participant": "p00001", "phase": "survey", "item": "useful", "answer": "4"} in answers
    assert (out / "runs" / "p00001" / "task" / "events.jsonl").is_file()
    assert [path.name for path in (out / "runs").iterdir()] == ["p00001"]
    assert not [path for path in (out, *out.rglob("*")) if path.stat().st_mode & 0o077]
    book = {row["name"]: row for row in rows_of(out / "documentation" / "codebook.csv")}
    assert book["likert_useful"]["values"].startswith("1 = strongly disagree; 2 = ")
    assert "objects in their receptacle" in book["delivered"]["description"]
    assert all(row["description"] for row in book.values())


def test_no_id_link_or_address_leaves_and_no_cell_is_a_formula(served, tmp_path):
    study, folder = served
    out = tmp_path / "export"
    assert main(["study", "export", str(study), str(folder), "--out", str(out)]) == 0
    for path in filter(lambda p: p.is_file(), out.rglob("*")):
        content = path.read_bytes()
        for secret in (*SECRETS, "c" * 64, "d" * 64, "MARKED", "p00002", "p00004", "127.0.0.1"):
            assert secret.encode() not in content and secret not in str(path.relative_to(out)), (path, secret)
    for path in out.rglob("*_data.csv"):
        for row in rows_of(path):
            for cell in filter(None, row.values()):
                assert not cell.startswith(FORMULA) or cell[1:].replace(".", "").isdigit(), cell


def test_of_who_does_not_agree_no_id_is_kept(served):
    _, folder = served
    with closing(sqlite3.connect(folder / "study.db")) as database:
        kept = [row[0] for row in database.execute("SELECT person_id FROM identity ORDER BY person_id")]
    assert kept == [1, 3, 4]


def test_an_export_is_whole_or_absent(served, tmp_path, monkeypatch):
    study, folder = served
    out = tmp_path / "export"
    command = ["study", "export", str(study), str(folder), "--out", str(out)]
    with monkeypatch.context() as full:

        def no_space(*_):
            raise OSError(28, "No space left on device")

        full.setattr(shutil, "copytree", no_space)
        assert main(command) == 1
    assert not out.exists() and not list(tmp_path.glob(".mjsim-work-*"))
    assert main(command) == 0
    before = (out / "README.md").stat().st_ino
    assert main(command) == 2, "an export is not replaced by mistake"
    assert main([*command, "--force"]) == 0
    assert (out / "README.md").stat().st_ino != before
    assert main(["study", "export", str(study), str(folder), "--out", str(folder)]) == 2


def test_the_metadata_follow_psych_ds(served, tmp_path):
    """The rules of the schema that are errors; the validator itself checks all of them, where there is one."""
    study, folder = served
    out = tmp_path / "export"
    assert main(["study", "export", str(study), str(folder), "--out", str(out)]) == 0
    about = json.loads((out / "dataset_description.json").read_text())
    assert about["@context"] == "https://schema.org/" and about["@type"] == "Dataset"
    assert about["name"] and about["description"]
    columns = {name for path in (out / "data").iterdir() for name in rows_of(path)[0]}
    assert {variable["name"] for variable in about["variableMeasured"]} == columns
    for path in (out / "data").iterdir():
        assert path.name.removesuffix("_data.csv").replace("_", "-").replace("-", "").isalnum()
    if command := os.environ.get(VALIDATOR):
        done = subprocess.run(
            [*shlex.split(command), str(out), "--json"], capture_output=True, text=True, timeout=120
        )
        result = json.loads(done.stdout[done.stdout.index("{") :])
        assert result["valid"], [issue for issue in result["issues"] if issue["severity"] == "error"]
    else:
        pytest.skip(f"{VALIDATOR} names no validator of Psych-DS")


@pytest.mark.slow
def test_nothing_of_who_came_by_http_is_in_an_export(tmp_path):
    """A study served to people of Prolific by a real server and a real worker, then exported."""
    study = read_people_study(_prolific(tmp_path))
    folder, addresses = tmp_path / "served", []
    folder.mkdir()

    async def note(_, url, *__):
        addresses.append(url)

    pool = WorkerPool(study.cells[0].trial(0).house)
    walked = asyncio.run(dry_run(study, recruiter(study.settings.recruitment), folder, pool, note))
    assert walked.faults == []
    asyncio.run(_export(dataclasses.replace(study, rehearsal=True), folder, tmp_path / "export"))
    tokens = {found[1] for url in addresses if (found := re.search("/play/([^/]+)", url))}
    assert len(tokens) >= 4
    secrets = {"rehearsal0", "127.0.0.1", "CODE12345", *tokens, *map(token_hash, tokens)}
    assert b"rehearsal0" in (folder / "study.db").read_bytes()
    for path in filter(lambda p: p.is_file(), (tmp_path / "export").rglob("*")):
        content = path.read_bytes()
        assert not [secret for secret in secrets if secret.encode() in content or secret in path.name], path


async def _export(study, folder, out):
    store = await Store.open(f"sqlite:///{folder / 'study.db'}", study.settings.name, study.sha256)
    await export(study, store, folder, out)
    await store.close()


def _prolific(tmp_path):
    path = tmp_path / "study.toml"
    assert main(["study", "init", str(path)]) == 0
    codes = 'completed = "CODE12345"\nscreened_out = "CODE12346"\nno_consent = "CODE12347"'
    text, times = re.subn('platform = "link".*', f'platform = "prolific"\n{codes}', path.read_text())
    assert times == 1
    path.write_text(text)
    return path
