"""Batches of packed trials: resumed, put aside, read and unpacked like batches of run directories."""

import shutil
from contextlib import closing

import pytest
from user_code import participant

from experiments.analysis.planning.preregistration import _settings_of_runs
from experiments.analysis.report.figures import _run_of
from experiments.cli.main import main
from experiments.record import records
from experiments.record.archive import adopt, new_archive, pack, run_paths
from experiments.record.run_directory import TRIALS
from experiments.trials import batch, trial_reader
from experiments.trials.batch import run_batch
from experiments.trials.batch_plan import check_trials, plan_batch
from experiments.trials.design import Design
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from experiments.trials.trial_reader import TrialReader

SAME = {"objects": 1, "fidelity": "event", "regret": False, "time_limit": 0.2}
ONE, TWO = (TrialConfig(**SAME, assistance=name, seed=0) for name in ("none", "optimal"))


@pytest.fixture(scope="module")
def folders(house, tmp_path_factory):
    """A batch of two trials; do not change it."""
    out = tmp_path_factory.mktemp("folders")
    for path, config in plan_batch([ONE, TWO], check_trials([ONE, TWO]), out).missing.items():
        run_trial(config, path, topdown=False, house=house)
    return out


@pytest.fixture
def packed(folders, tmp_path):
    """The same batch with packed trials."""
    (tmp_path / "b" / TRIALS).mkdir(parents=True)
    with closing(new_archive(tmp_path / "b" / TRIALS, "test")) as database:
        for run in run_paths(folders / TRIALS):
            pack(run, database)
    adopt(tmp_path / "b" / TRIALS)
    return tmp_path / "b"


def content(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def rows(out):
    return [trial.row for trial in TrialReader(out).read()[0]]


def plan(out, *trials):
    return plan_batch(trials, check_trials(trials), out)


@pytest.mark.slow
def test_a_packed_batch_is_resumed_and_extended_by_either_kind(folders, tmp_path, monkeypatch):
    out, reports, expected = tmp_path / "b", [], rows(folders)
    monkeypatch.setattr(
        trial_reader, "read_trial", None
    )  # workers have read all, so this process reads nothing
    first = run_batch(Design((ONE,)), out, workers=1, packed=True)
    assert [path.parent.suffix for path in run_paths(out / TRIALS)] == [".sqlar"]
    both = run_batch(Design((ONE, TWO)), out, workers=1, on_progress=reports.append)
    assert (reports[-1].resumed, reports[-1].done, both[0]) == (1, 1, first[0])
    assert sorted(path.parent.suffix for path in run_paths(out / TRIALS)) == ["", ".sqlar"]
    for row in (*both, *expected):
        del row["wall_s"]
    assert sorted(both, key=str) == sorted(expected, key=str)
    assert not list((out / TRIALS).glob(".*"))


def test_outdated_packed_trials_are_kept(packed, monkeypatch):
    monkeypatch.setattr("experiments.trials.fingerprint.source_digest", lambda *_: "edited")
    found = plan(packed, ONE)
    assert len(found.missing) == 1 and "code of mjsim changed" in found.notes[0]
    (old,) = run_paths(packed / "outdated")
    assert [old.name] == [path.name for path in found.missing]
    assert len(rows(packed)) == 1


def test_a_packed_trial_that_ended_early_is_kept_until_it_is_run_again(packed, own_module):
    own_module(participant("if self.count == 3: raise ValueError('lost')"))
    config = TrialConfig(**SAME, assistance="none", seed=0, user="own_code:build")
    (path,) = plan(packed, config).missing
    failure = batch._run(config, path, path.parent, "test")
    assert "lost" in failure and f"mjsim replay {path}`" in failure, "not the name of the work folder"
    batch._archive(path.parent, "test").close()
    batch._archive.cache_clear()
    adopt(packed / TRIALS)
    (early,) = (trial for trial in TrialReader(packed).read()[0] if not trial.complete)
    assert early.path == path and not path.exists()
    found = plan(packed, config)
    assert list(found.missing) == [path] and "ended early" in found.notes[0]
    assert len(run_paths(packed / TRIALS)) == 2 and not (packed / "outdated").exists()


def test_a_damaged_packed_trial_is_named_and_run_again(packed, capsys):
    (archive,) = (packed / TRIALS).iterdir()
    one = next(iter(plan(packed / "new", ONE).missing)).name
    with closing(new_archive(packed / TRIALS, "bad")) as database, database:
        database.execute("ATTACH ? AS other", (str(archive),))
        database.execute("INSERT INTO sqlar SELECT * FROM other.sqlar")
        database.execute(
            "UPDATE sqlar SET data = zeroblob(length(data)) WHERE name = ?", (f"{one}/{records.EVENTS}",)
        )
    archive.unlink()
    adopt(packed / TRIALS)
    assert main(["metrics", str(packed)]) == 1
    assert f"{one}/{records.EVENTS} is damaged" in capsys.readouterr().err
    assert main(["unpack", str(packed)]) == 1
    assert f"{one}/{records.EVENTS} is damaged" in capsys.readouterr().err
    assert len(run_paths(packed / TRIALS)) == 2, "the other one is unpacked"
    found = plan(packed, ONE, TWO)
    assert [path.name for path in found.missing] == [one] and "is damaged" in found.notes[0]
    assert [path.name for path in run_paths(packed / "outdated")] == [one]


def test_packed_trials_are_unpacked_to_the_same_bytes(folders, packed):
    names = sorted(path.name for path in (folders / TRIALS).iterdir())
    assert main(["unpack", str(packed), "nobody"]) == 2
    assert main(["unpack", str(packed), names[0]]) == 0
    assert content(packed / TRIALS / names[0]) == content(folders / TRIALS / names[0])
    assert [path.parent.suffix for path in run_paths(packed / TRIALS)] == ["", ".sqlar"]
    assert main(["unpack", str(packed)]) == 0
    assert content(packed / TRIALS) == content(folders / TRIALS)


def test_commands_read_packed_trials(folders, packed, capsys):
    name = run_paths(folders / TRIALS)[0].name
    for words in (["metrics"], ["metrics", name], ["replay", name]):
        told = []
        for out in (folders, packed):
            path = out / TRIALS / words[1] if len(words) > 1 else out
            assert main([words[0], str(path)]) == 0
            told.append(capsys.readouterr().out)
        assert told[0] == told[1] != ""
    (archive,) = (packed / TRIALS).iterdir()
    assert main(["replay", str(archive)]) == 2
    assert "name one of them" in capsys.readouterr().err


def test_analyses_read_packed_trials(folders, packed):
    assert _settings_of_runs(packed) == _settings_of_runs(folders) != []
    for row in rows(folders):
        assert _run_of(row, packed).name == _run_of(row, folders).name


def test_a_run_directory_precedes_a_packed_trial_of_its_name(folders, packed):
    first = run_paths(folders / TRIALS)[0]
    shutil.copytree(first, packed / TRIALS / first.name)
    assert [path.parent.suffix for path in run_paths(packed / TRIALS)] == ["", ".sqlar"]
    assert len(rows(packed)) == 2
