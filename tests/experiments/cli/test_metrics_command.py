"""`mjsim metrics`: the numbers of metrics.json from log and trajectory alone, for a run and for a batch."""

import csv
import json
import shutil
from pathlib import Path

import pytest

from experiments.cli.main import main
from experiments.record import records
from experiments.record.files import read_json, write_json
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    out = tmp_path_factory.mktemp("metrics") / "run"
    config = TrialConfig(objects=6, assistance="none", seed=3, time_limit=8.0, fidelity="event")
    run_trial(config, out, topdown=False)
    return out


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    out = tmp_path_factory.mktemp("finished") / "run"
    run_trial(TrialConfig(objects=1, assistance="optimal", seed=3, fidelity="event"), out, topdown=False)
    return out


@pytest.fixture
def batch(run, tmp_path):
    for name in ("one", "two"):
        shutil.copytree(run, tmp_path / "batch" / "trials" / name)
    return tmp_path / "batch"


def test_a_run_without_its_metrics_is_measured_anew(run, tmp_path, capsys):
    folder = shutil.copytree(run, tmp_path / "run")
    (folder / records.METRICS).unlink()
    assert main(["metrics", str(folder), "--out", str(tmp_path / "m.json")]) == 0
    (row,) = read_json(tmp_path / "m.json")
    expected = read_json(run / records.METRICS)
    assert expected["simulated"] is True  # the default participant is no person
    for name in ("frames_sha256", "renderer", "wall_s"):
        del expected[name], row[name]
    assert row == expected
    assert main(["metrics", str(folder)]) == 0
    shown = dict(
        line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines() if " " in line.strip()
    )
    assert float(shown["task_distance_m"]) == expected["task_distance_m"]


def test_metrics_that_say_something_else_are_named(run, tmp_path, capsys):
    folder = shutil.copytree(run, tmp_path / "run")
    write_json(folder / records.METRICS, {**read_json(run / records.METRICS), "nd_feasible": 0.99})
    assert main(["metrics", str(folder)]) == 0
    printed = capsys.readouterr()
    assert "metrics.json differs from these metrics of the log" in printed.err
    assert "0.99" not in printed.out


@pytest.mark.parametrize("number", [1, 4])
def test_an_event_that_lacks_its_time_is_named_with_its_line(run, tmp_path, capsys, number):
    folder = shutil.copytree(run, tmp_path / "run")
    lines = (folder / records.EVENTS).read_text().splitlines()
    lines[number] = json.dumps({key: value for key, value in json.loads(lines[number]).items() if key != "t"})
    (folder / records.EVENTS).write_text("\n".join([*lines, ""]))
    assert main(["metrics", str(folder)]) == 2
    assert f"{records.EVENTS}, line {number + 1}: " in capsys.readouterr().err


def test_a_batch_gives_a_row_per_trial_and_names_those_that_cannot_be_measured(batch, capsys):
    table = batch.with_name("table.csv")
    table.touch()
    assert main(["metrics", str(batch), "--out", str(table)]) == 2, "what exists is kept"
    assert main(["metrics", str(batch), "--out", str(table), "--force"]) == 0
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert len(rows) == 2 and rows[0] == rows[1]
    assert rows[0]["assistance"] == "none" and float(rows[0]["completion_time_s"]) == 8.0
    log = batch / "trials" / "one" / records.EVENTS
    log.write_bytes(log.read_bytes().replace(b'"deviated": true', b'"deviated": false'))
    with log.open("a") as file:
        file.write("{}\n")
    assert main(["metrics", str(batch)]) == 1
    printed = capsys.readouterr()
    assert "one" in printed.err and len(printed.out.splitlines()) == 2


@pytest.mark.slow
@pytest.mark.parametrize("server", ["", "none"])
def test_people_who_play_are_measured_and_get_into_a_study(finished, tmp_path, capsys, server):
    folder = tmp_path / "play"
    task = {name: read_json(finished / records.METRICS)[name] for name in ("assistance", "objects", "user")}
    for name in ("a1", "b2", "c3"):
        (folder / server / name).mkdir(parents=True)
        write_json(folder / server / name / "visit.json", {"trials": {"task": task}})
    for name in ("a1", "b2"):
        shutil.copytree(finished, folder / server / name / "task")
    assert main(["metrics", str(folder)]) == 0
    rows = list(csv.DictReader(capsys.readouterr().out.splitlines()))
    visits = [str(Path(server, name)) for name in ("a1", "b2")]
    assert [(row["participant"], row["delivered"]) for row in rows] == [(name, "1") for name in visits]
    assert main(["study", "analyze", str(folder)]) == 0
    people = csv.DictReader((folder / "analysis" / "people.csv").read_text().splitlines())
    assert [row["participant"] for row in people] == visits
    report = (folder / "analysis" / "report.html").read_text()
    assert str(Path(server, "c3")) in report, "who did not finish is named"


def test_other_folders_are_refused_in_one_line(tmp_path, capsys):
    assert main(["metrics", str(tmp_path)]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "neither a run directory nor the folder of a batch" in line
