"""What exists is kept: no command replaces anything unasked, and each looks where it will write before it computes."""

import json
import os

import pytest

from experiments.cli.main import main
from experiments.errors import RecordError
from experiments.record.records import EPISODE, EVENTS, METRICS
from experiments.record.run_directory import run_directory
from faults.conftest import PROBLEM, one_line


def fill_run(folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name in (EPISODE, EVENTS, METRICS):
        (folder / name).write_text("{}")


def write(file, text="precious"):
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text)


NOTES = "notes.txt"
NO_FILM = 'phases = ["consent", "training", "task", "survey", "completion"]\n'  # of a study file


def fill_batch(folder):
    fill_run(folder / "trials" / "one")
    write(folder / "trials.csv", "objects\n")


STATES = {  # by name: what makes the state of a path
    "run": [fill_run],
    "run with notes": [fill_run, lambda path: write(path / NOTES)],
    "notes": [lambda path: write(path / NOTES)],
    "batch": [fill_batch],
    "strange batch": [fill_batch, lambda path: write(path / "trials" / "mine" / NOTES)],
    "tables of others": [lambda path: write(path / "trials.csv"), lambda path: (path / "trials").mkdir()],
    "file": [write],
    "dangling link": [lambda path: path.symlink_to(path.with_name("nowhere"))],
    "loop": [lambda path: path.symlink_to(path)],
    "link to notes": [
        lambda path: write(path.with_name("real") / NOTES),
        lambda path: path.symlink_to("real"),
    ],
    "pipe": [os.mkfifo],
    "below a file": [write],
}


def make(state, path):
    """Bring a path into a state; returns where a command is told to write."""
    for step in STATES[state]:
        step(path)
    return path / "run" if state == "below a file" else path


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

    # Imports the module, before the origin of `solver` is changed below.
    monkeypatch.setattr("experiments.cli.plan.solver", fail)
    for name in ("experiments.house.House.load", "tools.gallery.take_pictures", "planner.solvers.solver"):
        monkeypatch.setattr(name, fail)
    monkeypatch.setattr("experiments.trials.replay.replay.replay", fail)
    monkeypatch.setattr("mjsim.house.check.check_path", fail)
    monkeypatch.setattr("experiments.analysis.comparison.read_blocks", fail)


def refused(words, tmp_path, capsys, codes=(1, 2)):
    """The line with which a command refuses to write; everything is as it was."""
    before = tree(tmp_path)
    assert main([str(word) for word in words]) in codes
    line = one_line(capsys.readouterr().err)
    assert tree(tmp_path) == before
    return line


@pytest.mark.parametrize("force", [[], ["--force"]], ids=["", "force"])
@pytest.mark.parametrize(
    "state", [state for state in STATES if state not in ("run", "tables of others", "strange batch")]
)
def test_a_run_replaces_nothing_but_runs(state, force, tmp_path, capsys):
    place = make(state, tmp_path / "out")
    line = refused(["run", "--no-video", *force, "--out", place], tmp_path, capsys)
    assert str(tmp_path / "out") in line


def test_a_run_is_replaced_only_when_told_so(tmp_path, capsys):
    fill_run(tmp_path / "out")
    assert "--force" in refused(["run", "--out", tmp_path / "out"], tmp_path, capsys)


@pytest.mark.parametrize("place", [".", "/", "..", "x" * 300, "/proc/run", "/dev/null"])
def test_places_where_no_run_can_be(place, tmp_path, capsys, monkeypatch):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    refused(["run", "--no-video", "--force", "--out", place], tmp_path, capsys)


@pytest.mark.parametrize(
    "state", ["notes", "run", "file", "strange batch", "tables of others", "loop", "dangling link"]
)
def test_a_batch_adds_to_batches_alone(state, tmp_path, capsys):
    make(state, tmp_path / "out")
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


@pytest.mark.parametrize("state", ["file", "notes", "dangling link", "loop", "pipe", "below a file"])
@pytest.mark.parametrize("command", ["house", "plan", "replay", "bench", "check", "compare"])
def test_files_that_exist_are_kept(command, state, tmp_path, capsys):
    words = commands_that_write_a_file(tmp_path)[command]
    place = make(state, tmp_path / "out.xml")
    assert str(tmp_path / "out.xml") in refused([*words, place], tmp_path, capsys)


@pytest.mark.parametrize("command", ["house", "plan", "replay"])
@pytest.mark.parametrize("place", ["/dev/null", "/proc/out.xml", "x" * 300 + ".xml", "."])
def test_files_that_cannot_be(command, place, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = commands_that_write_a_file(tmp_path)[command]
    refused([*words, place, "--force"], tmp_path, capsys)


def test_what_lies_inside_is_kept_too(tmp_path, capsys):
    write(tmp_path / "out" / "none.png")
    assert "out/none.png" in refused(["gallery", "--out", tmp_path / "out"], tmp_path, capsys)


def test_a_run_that_finds_its_place_taken_is_kept_beside_it(tmp_path):
    with (
        pytest.raises(RecordError, match=r"the run is kept in .*out-2"),
        run_directory(tmp_path / "out") as folder,
    ):
        fill_run(folder)
        write(tmp_path / "out" / NOTES)
    assert (tmp_path / "out" / NOTES).read_text() == "precious"
    assert (tmp_path / "out-2" / METRICS).is_file()


def test_a_run_that_leaves_nothing_leaves_no_folders(tmp_path):
    with pytest.raises(ZeroDivisionError), run_directory(tmp_path / "a" / "b" / "out"):
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []


def test_a_study_whose_database_is_refused_leaves_no_data(mjsim, tmp_path):
    mjsim("study", "init", "study.toml")
    study = tmp_path / "study.toml"
    text = study.read_text()
    study.write_text(NO_FILM.join([text[: text.index("[study.minimum]")], text[text.index("[study.pay]") :]]))
    end = mjsim(
        "study", "serve", "study.toml", "--out", "out", "--port", "0", "--no-open", "--database", "me"
    )
    assert "is not a database URL" in one_line(end.stderr)
    assert not list((tmp_path / "out").iterdir())
