"""The file of `mjsim study init`, with the phase and the survey of the docs, goes through all commands."""

import asyncio
import re
import subprocess
import sys
from contextlib import AsyncExitStack
from pathlib import Path

import httpx
import msgspec
import numpy as np
import pyarrow.parquet as pq
import pytest

from experiments.cli.main import main
from experiments.cli.server import http_server, listen, url_of
from experiments.cli.study.database import sqlite_url
from experiments.session.video import VideoWriter
from experiments.study.file import read_people_study
from experiments.study.plan import plan_of
from experiments.study.rehearsal.person import Rehearsed, SimulatedPerson, Surroundings
from experiments.study.rehearsal.plan import Planned
from experiments.study.rehearsal.player import homes_in
from experiments.visit.folders import VisitFolders
from experiments.visit.procedure import Procedure
from experiments.visit.server.app import ServerOptions, VisitServer
from experiments.visit.store import Store
from experiments.visit.tokens import token_hash
from experiments.web.server.pool import WorkerPool

PATIENCE = 120.0  # s
ASKED_FOR = (("your institution", "A university"), ("you@example.org", "people@university.edu"))
PAGE = (Path(__file__).parents[3] / "docs" / "study-file.md").read_text()


def written(language, part):
    """The code of docs/study-file.md that contains a text."""
    [code] = [code for code in re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL) if part in code]
    return code


@pytest.fixture
def study(tmp_path, monkeypatch):
    """The file of `study init` with an institution, an address, and what the docs say about own phases and items."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "mood.py").write_text(written("python", "class Mood"))
    survey = written("toml", "survey.item").partition("[[survey.item]]")
    (tmp_path / "my_texts.toml").write_text("".join(survey[1:]) + written("toml", '["mood:Mood"]'))
    path = tmp_path / "study.toml"
    assert main(["study", "init", str(path)]) == 0
    text = path.read_text()
    for before, after in ASKED_FOR:
        assert before in text
        text = text.replace(before, after)
    settings = written("toml", 'texts = "my_texts.toml"\nphases')
    path.write_text(text.replace("[study]\n", f"[study]\n{settings}", 1))
    return path


def film(path):
    with VideoWriter(path, width=160, height=120) as video:
        video.write(np.zeros((120, 160, 3), np.uint8))
    return path


def start_once(command):
    """Start the server, look at its first page, and stop it."""
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            url = server.stdout.readline().strip()
            assert httpx.get(url, timeout=PATIENCE).status_code == 200
        finally:
            server.terminate()
        assert server.wait(PATIENCE) in (0, 143)


async def take_part(path, folder, film_file, people, leaves=()):
    """Let people take part in the served study like real ones, but without waiting. Those in `leaves` leave the task.

    `people` are new people's numbers, or what came of those who return.
    """
    study = read_people_study(path)
    store = await Store.open(sqlite_url(folder / "study.db"), study.settings.name, study.sha256, create=False)
    plan = msgspec.structs.replace(plan_of(study, film_file), rehearsal=True, minimum={})
    procedure = Procedure(plan, store, VisitFolders(folder / "visits"), np.random.default_rng(0))
    house = study.cells[0].trial(0).house
    server = VisitServer(procedure, WorkerPool(house), ServerOptions(b"secret", workers=2))
    async with AsyncExitStack() as stack:
        listener = stack.enter_context(listen("127.0.0.1", 0))
        base, http = url_of(listener).rstrip("/"), http_server(server.app("127.0.0.1"))
        serving = asyncio.create_task(http.serve([listener]))
        client = await stack.enter_async_context(httpx.AsyncClient(base_url=base, timeout=PATIENCE))
        around = Surroundings(base, client, plan, homes_in(procedure.folders), {}, 1e6)
        gone = [Rehearsed(one) if isinstance(one, int) else one for one in people]
        for one in gone:
            how, where = ("vanishes", "task") if one.number in leaves else (None, "")
            planned = Planned(one.number, one.number, 0.0, how, where, None, None, False, False, False)
            person = SimulatedPerson(planned, around, one)
            if not one.link:
                await person.begin()
            await person.go()
        http.should_exit = True
        await serving
    return gone


@pytest.mark.slow
def test_the_file_of_init_goes_through_all_commands(tmp_path, study, capsys):
    served, rehearsal, table = (tmp_path / name for name in ("served", "rehearsal", "table"))
    moving = film(tmp_path / "film.mp4")
    assert main(["study", "check", str(study)]) == 0, capsys.readouterr().out
    rehearse = ["study", "rehearse", str(study), "--people", "2", "--dropouts", "0", "--per-minute", "30"]
    assert main([*rehearse, "--film", str(moving), "--out", str(rehearsal)]) == 0, capsys.readouterr().out
    assert (rehearsal / "analysis" / "report.html").is_file()
    serve = [
        "study",
        "serve",
        str(study),
        "--out",
        str(served),
        "--film",
        str(moving),
        "--port",
        "0",
        "--no-open",
    ]
    start_once([sys.executable, "-m", "experiments.cli.main", *serve])
    gone = asyncio.run(take_part(study, served, moving, range(2)))
    assert [(one.outcome, one.faults) for one in gone] == [("finished", [])] * 2
    names = [str(study), str(served)]
    assert main(["study", "collect", *names, "--out", str(table)]) == 0
    (row, _) = pq.read_table(table / "trials.parquet").to_pylist()
    assert (
        row["mood:Mood_calm"] in (1, 2, 3, 4)
        and row["likert_calm"] in (1, 2, 3, 4, 5)
        and not row["inattentive"]
    )
    assert main(["study", "analyze", str(table), "--exclude", str(study)]) == 0, capsys.readouterr().err
    assert main(["study", "export", *names, "--out", str(tmp_path / "export")]) == 0
    assert main(["study", "pay", *names]) == 0
    assert "15.00 USD are owed in 2 of 2 payments" in capsys.readouterr().out
    paid = ["--paid", "p00001-reward", "--reference", "receipt", "--rehearsal", str(rehearsal)]
    assert main(["study", "pay", *names, *paid]) == 0


HOMES = """
[all_cells]
user = "guest"
fidelity = "event"
regret = false
objects = 1
house_seeds = 57
houses = "generated:0:4?rooms=2"

[[cells]]
assistance = "none"
people = 4

[[cells]]
assistance = "optimal"
seeds = "4:8"

[study]
name = "homes"
title = "Tidying up"
institution = "A university"
contact = "people@university.edu"
minutes = 10
phases = ["consent", "story", "comprehension", "task", "survey", "completion"]

[study.pay]
reward = 2.0
"""


def home_of(served, one):
    return (
        VisitFolders(served / "visits")
        .find(token_hash(one.link.rpartition("/")[2]))
        .settings("task")["house"]
    )


@pytest.mark.slow
@pytest.mark.long
def test_each_participant_has_a_home_of_the_range_until_the_data_are_analysed(tmp_path, monkeypatch, capsys):
    study, served, rehearsal, table = (tmp_path / name for name in ("s.toml", "served", "rehearsal", "table"))
    study.write_text(HOMES)
    assert main(["study", "check", str(study)]) == 0, capsys.readouterr().out
    rehearse = ["study", "rehearse", str(study), "--people", "4", "--dropouts", "0", "--per-minute", "30"]
    assert main([*rehearse, "--out", str(rehearsal)]) == 0, capsys.readouterr().out
    serve = ["study", "serve", str(study), "--out", str(served), "--port", "0", "--no-open"]
    start_once([sys.executable, "-m", "experiments.cli.main", *serve])
    with monkeypatch.context() as early:
        early.setattr("experiments.study.rehearsal.person.moment", lambda *_: 1)  # before the task is over
        first = asyncio.run(take_part(study, served, None, range(4), leaves=(2,)))
    assert [one.outcome for one in first] == ["finished", "finished", "vanishes", "finished"]
    homes = [home_of(served, one) for one in first]
    later = asyncio.run(take_part(study, served, None, [first[2], *range(4, 8)]))
    assert [(one.outcome, one.faults) for one in later] == [("finished", [])] * 5
    assert [home_of(served, one) for one in first] == homes
    names = [str(study), str(served)]
    assert main(["study", "collect", *names, "--out", str(table)]) == 0
    rows = pq.read_table(table / "trials.parquet").to_pylist()
    wanted = [cell.trial(place).house for cell in read_people_study(study).cells for place in range(4)]
    assert sorted(row["house"] for row in rows if row["assistance"] == "none") == sorted(wanted[:4])
    assert sorted(row["house"] for row in rows) == sorted(wanted)
    assert {row["participant"]: row["house"] for row in rows}["p00003"] == homes[2]
    assert main(["study", "analyze", str(table)]) == 0, capsys.readouterr().err
    assert main(["study", "export", *names, "--out", str(tmp_path / "export")]) == 0
    assert main(["study", "pay", *names]) == 0
    assert "16.00 USD are owed in 8 of 8 payments" in capsys.readouterr().out
