"""What exists is kept: no command replaces anything unasked, and each looks where it will write before it computes."""

import json
import os

import pytest

from experiments.cli import main
from experiments.errors import RecordError
from experiments.runs.records import EPISODE, EVENTS, METRICS
from experiments.runs.run_directory import run_directory

PROBLEM = {"distances": [[0, 1], [1, 0]], "shipments": [{"pickup": 0, "delivery": 1}]}


def fill_run(folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name in (EPISODE, EVENTS, METRICS):
        (folder / name).write_text("{}")


def make_run(path):
    fill_run(path)


def make_run_with_notes(path):
    fill_run(path)
    (path / "notes.txt").write_text("precious")


def make_notes(path):
    path.mkdir()
    (path / "notes.txt").write_text("precious")


def make_batch(path):
    fill_run(path / "trials" / "one")
    (path / "trials.csv").write_text("objects\n")


def make_strange_batch(path):
    make_batch(path)
    make_notes(path / "trials" / "mine")


def make_tables_of_others(path):
    (path / "trials").mkdir(parents=True)
    (path / "trials.csv").write_text("patient\n")


def make_file(path):
    path.write_text("precious")


def make_dangling_link(path):
    path.symlink_to(path.with_name("nowhere"))


def make_loop(path):
    path.symlink_to(path)


def make_link_to_notes(path):
    make_notes(path.with_name("real"))
    path.symlink_to(path.with_name("real"))


def make_pipe(path):
    os.mkfifo(path)


def below_a_file(path):
    path.parent.mkdir(exist_ok=True)
    path.write_text("precious")
    return path / "run"


def tree(folder):
    """Everything in a folder: names, and contents of files."""
    return {
        path.relative_to(folder): path.read_bytes() if path.is_file() else path.is_dir()
        for path in folder.rglob("*")
    }


@pytest.fixture(autouse=True)
def nothing_is_computed(monkeypatch):
    def fail(*_args, **_options):
        pytest.fail("computed before it was known where to write")

    for name in (
        "experiments.house.House.load",
        "experiments.gallery.take_pictures",
        "planner.solver.solver",
    ):
        monkeypatch.setattr(name, fail)
    monkeypatch.setattr("experiments.commands.gallery.take_pictures", fail)
    monkeypatch.setattr("experiments.commands.plan.solver", fail)
    monkeypatch.setattr("experiments.commands.replay.replay", fail)
    monkeypatch.setattr("experiments.commands.check.check_path", fail)
    monkeypatch.setattr("experiments.commands.compare.read_blocks", fail)


def refused(words, tmp_path, capsys, codes=(1, 2)):
    """The line with which a command refuses to write; everything is as it was."""
    before = tree(tmp_path)
    assert main([str(word) for word in words]) in codes
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("mjsim: ")
    assert tree(tmp_path) == before
    return lines[0]


@pytest.mark.parametrize("force", [[], ["--force"]], ids=["", "force"])
@pytest.mark.parametrize(
    "make",
    [
        make_run_with_notes,
        make_notes,
        make_batch,
        make_file,
        make_dangling_link,
        make_loop,
        make_link_to_notes,
        make_pipe,
        below_a_file,
    ],
)
def test_a_run_replaces_nothing_but_runs(make, force, tmp_path, capsys):
    place = make(tmp_path / "out") or tmp_path / "out"
    line = refused(["run", "--no-video", *force, "--out", place], tmp_path, capsys)
    assert str(tmp_path / "out") in line


def test_a_run_is_replaced_only_when_told_so(tmp_path, capsys):
    make_run(tmp_path / "out")
    assert "--force" in refused(["run", "--out", tmp_path / "out"], tmp_path, capsys)


@pytest.mark.parametrize("place", [".", "", "/", "..", "x" * 300, "/proc/run", "/dev/null"])
def test_places_where_no_run_can_be(place, tmp_path, capsys, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    refused(["run", "--no-video", "--force", "--out", place], tmp_path, capsys)


@pytest.mark.parametrize(
    "make",
    [
        make_notes,
        make_run,
        make_file,
        make_strange_batch,
        make_tables_of_others,
        make_loop,
        make_dangling_link,
    ],
)
def test_a_batch_adds_to_batches_alone(make, tmp_path, capsys):
    make(tmp_path / "out")
    line = refused(["batch", "--seeds", "0", "--out", tmp_path / "out"], tmp_path, capsys)
    assert str(tmp_path / "out") in line


def commands_that_write_a_file(tmp_path):
    problem = tmp_path / "problem.json"
    problem.write_text(json.dumps(PROBLEM))
    return {
        "house": ["house", "--out"],
        "plan": ["plan", problem, "--certificate"],
        "replay": ["replay", tmp_path, "--video"],
        "bench": ["bench", "planner", "--picture"],
        "check": ["check", "apartment", "--picture"],
        "compare": ["compare", tmp_path, "--csv"],
    }


@pytest.mark.parametrize(
    "make", [make_file, make_notes, make_dangling_link, make_loop, make_pipe, below_a_file]
)
@pytest.mark.parametrize("command", ["house", "plan", "replay", "bench", "check", "compare"])
def test_files_that_exist_are_kept(command, make, tmp_path, capsys):
    words = commands_that_write_a_file(tmp_path)[command]
    place = make(tmp_path / "out.xml") or tmp_path / "out.xml"
    assert str(tmp_path / "out.xml") in refused([*words, place], tmp_path, capsys)


@pytest.mark.parametrize("command", ["house", "plan", "replay"])
@pytest.mark.parametrize("place", ["/dev/null", "/proc/out.xml", "x" * 300 + ".xml", "."])
def test_files_that_cannot_be(command, place, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = commands_that_write_a_file(tmp_path)[command]
    refused([*words, place, "--force"], tmp_path, capsys)


def test_the_episode_beside_a_house_is_kept_too(tmp_path, capsys):
    (tmp_path / "out.episode.json").write_text("precious")
    refused(["house", "--out", tmp_path / "out.xml"], tmp_path, capsys)


def test_pictures_that_exist_are_kept(tmp_path, capsys):
    (tmp_path / "none.png").write_text("precious")
    assert "none.png" in refused(["gallery", "--out", tmp_path], tmp_path, capsys)


def test_a_run_that_finds_its_place_taken_is_kept_beside_it(tmp_path):
    with (
        pytest.raises(RecordError, match=r"the run is kept in .*out-2"),
        run_directory(tmp_path / "out") as folder,
    ):
        fill_run(folder)
        make_notes(tmp_path / "out")
    assert (tmp_path / "out" / "notes.txt").read_text() == "precious"
    assert (tmp_path / "out-2" / METRICS).is_file()


def test_a_run_that_leaves_nothing_leaves_no_folders(tmp_path):
    with pytest.raises(ZeroDivisionError), run_directory(tmp_path / "a" / "b" / "out"):
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []
