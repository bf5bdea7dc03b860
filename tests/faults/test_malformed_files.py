"""Files that are none: every reader says in one line which file it is, and nothing is written."""

import pickle
import shutil

import numpy as np
import pytest

from experiments.cli import main
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from faults.conftest import one_line

DEEP = 200_000  # brackets in brackets
BAD_TEXTS = {
    "deep lists": b"[" * DEEP + b"]" * DEEP,
    "deep objects": b'{"a":' * DEEP + b"1" + b"}" * DEEP,
    "deep TOML": b"a = " + b"[" * DEEP + b"]" * DEEP,
    "not UTF-8": b'{"name": "caf\xe9"}',
    "empty": b"",
    "null": b"null",
    "number": b"1e999",
    "list": b"[]",
    "NUL": b"\0" * 100,
    "long number": b"9" * 10_000,
}


@pytest.fixture(scope="module")
def a_run(house, tmp_path_factory):
    out = tmp_path_factory.mktemp("runs") / "run"
    config = TrialConfig(
        objects=2, assistance="optimal", seed=0, fidelity="event", regret=False, time_limit=4.0
    )
    run_trial(config, out, topdown=False, house=house)
    return out


def refused(words, capsys):
    code = main([str(word) for word in words])
    line = one_line(capsys.readouterr().err)
    assert code in (1, 2), line
    return line


@pytest.mark.parametrize("content", BAD_TEXTS.values(), ids=BAD_TEXTS)
@pytest.mark.parametrize(
    ("words", "name"),
    [
        (["plan", "FILE"], "problem.json"),
        (["run", "--out", "OUT", "--no-video", "--episode", "FILE"], "episode.json"),
        (["run", "--out", "OUT", "--no-video", "--house", "FILE"], "catalogue.toml"),
        (["batch", "FILE", "--out", "OUT"], "design.toml"),
    ],
    ids=["problem", "episode", "catalogue", "design"],
)
def test_inputs(words, name, content, tmp_path, capsys):
    (tmp_path / name).write_bytes(content)
    places = {"FILE": tmp_path / name, "OUT": tmp_path / "out"}
    assert name in refused([places.get(word, word) for word in words], capsys)
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("content", BAD_TEXTS.values(), ids=BAD_TEXTS)
@pytest.mark.parametrize(
    "name", ["episode.json", "events.jsonl", "metrics.json", "plan.json", "SHA256SUMS", "trajectory.npz"]
)
def test_files_of_a_run(name, content, a_run, tmp_path, capsys):
    folder = tmp_path / "run"
    shutil.copytree(a_run, folder)
    (folder / name).write_bytes(content)
    assert name in refused_replay(folder, capsys)


@pytest.mark.parametrize("kind", ["strings", "objects", "complex", "empty"])
@pytest.mark.parametrize("name", ["trajectory.npz", "recording.npz"])
def test_forged_arrays(name, kind, a_run, tmp_path, capsys):
    folder = tmp_path / "run"
    shutil.copytree(a_run, folder)
    with np.load(folder / name) as archive:
        arrays = {key: archive[key] for key in archive.files}
    forge = {
        "strings": lambda a: np.full(a.shape, "x"),
        "objects": lambda a: np.full(a.shape, {}, dtype=object),
        "complex": lambda a: np.full(a.shape, 1j),
        "empty": lambda a: a[:0],
    }[kind]
    np.savez(folder / name, **{key: forge(array) for key, array in arrays.items()})
    assert ".npz" in refused_replay(folder, capsys)


def refused_replay(folder, capsys):
    code = main(["replay", str(folder)])
    said = capsys.readouterr()
    line = one_line(said.err)
    assert code in (1, 2), line
    return said.out + line


class Harmful:
    def __reduce__(self):
        return print, ("a pickle was executed",)


def test_a_pickle_is_never_executed(a_run, tmp_path, capsys):
    folder = tmp_path / "run"
    shutil.copytree(a_run, folder)
    (folder / "trajectory.npz").write_bytes(pickle.dumps(Harmful()))
    assert "executed" not in refused_replay(folder, capsys)
