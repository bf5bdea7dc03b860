"""A finished trial is read once, and again only after it has changed."""

import gzip
import json
import os
import shutil

import pytest
from msgspec.structs import replace

from experiments.participants.distribution import Distributions
from experiments.record import records
from experiments.record.files import CHECKSUMS
from experiments.record.metrics import measure
from experiments.trials import batch_folder, trial_reader
from experiments.trials.batch import run_batch
from experiments.trials.batch_folder import read_trial
from experiments.trials.design import Design
from experiments.trials.fingerprint import code_versions
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from experiments.trials.trial_reader import ROWS, TrialReader


def brief(seed):
    return TrialConfig(
        objects=1, assistance="none", seed=seed, fidelity="event", regret=False, time_limit=0.2
    )


@pytest.fixture(scope="module")
def batch(house, tmp_path_factory):
    """A folder with three trials that came to their end."""
    folder = tmp_path_factory.mktemp("batch")
    for seed in range(3):
        run_trial(brief(seed), folder / "trials" / f"t{seed}", topdown=False, house=house)
    return folder


@pytest.fixture
def folder(batch, tmp_path):
    """A copy of it, with the same modification times."""
    return shutil.copytree(batch, tmp_path / "out")


@pytest.fixture
def read(monkeypatch):
    """Names of the trials that were read."""
    names = []

    def note(path):
        names.append(path.name)
        return read_trial(path)

    monkeypatch.setattr(trial_reader, "read_trial", note)
    return names


def test_what_is_kept_equals_what_is_read(folder, read):
    first, _ = TrialReader(folder).read()
    assert read == ["t0", "t1", "t2"]
    second, unusable = TrialReader(folder).read()
    assert read == ["t0", "t1", "t2"] and unusable == {}
    assert second == first == [read_trial(trial.path) for trial in first]
    assert repr([t.row for t in second]) == repr([t.row for t in first])  # in types and order, too


def test_metrics_of_the_same_versions_are_read_and_others_are_computed(folder, monkeypatch):
    path, computed = folder / "trials" / "t0", []

    def measured(*given):
        computed.append(path)
        return measure(*given)

    monkeypatch.setattr(batch_folder, "measure", measured)
    monkeypatch.setattr(batch_folder, "_versions", code_versions)  # not those cached by another test
    found = read_trial(path)
    assert not computed and found.as_measured
    again = read_trial(path, recompute=True)
    assert computed == [path] and again == found and list(again.row) == list(found.row)
    monkeypatch.setattr(batch_folder, "_versions", lambda: {**again.inputs, "numpy": "0"})
    assert read_trial(path) == found and len(computed) == 2


@pytest.mark.parametrize("file", [records.METRICS, CHECKSUMS])
def test_metrics_with_a_wrong_checksum_are_computed(folder, file):
    path = folder / "trials" / "t0"
    row = read_trial(path).row
    forged = json.loads((path / records.METRICS).read_text()) | {"delivered": 9}
    (path / records.METRICS).write_text(json.dumps(forged))
    if file == CHECKSUMS:  # a line is missing
        lines = (path / CHECKSUMS).read_text().splitlines(keepends=True)
        (path / CHECKSUMS).write_text("".join(line for line in lines if records.METRICS not in line))
    trial = read_trial(path)
    assert trial.row == row and not trial.as_measured


def test_a_folder_that_was_moved_is_not_read_again(folder, read):
    TrialReader(folder).read()
    moved = folder.rename(folder.with_name("moved"))
    found, _ = TrialReader(moved).read()
    assert len(read) == 3 and [trial.path.parent for trial in found] == [moved / "trials"] * 3


@pytest.mark.parametrize(
    "name", [records.EVENTS, records.TRAJECTORY, records.EPISODE, records.RECORDING, records.METRICS]
)
def test_a_file_of_the_same_size_and_another_time_is_read_again(folder, read, name):
    TrialReader(folder).read()
    path = folder / "trials" / "t1" / name
    content, size = path.read_bytes(), path.stat().st_size
    path.write_bytes(content[:-2] + bytes([content[-2] ^ 1]) + content[-1:])
    os.utime(path, ns=(0, path.stat().st_mtime_ns + 1))
    assert path.stat().st_size == size
    found, unusable = TrialReader(folder).read()
    assert read[3:] == ["t1"]
    if name == records.METRICS:
        assert not found[1].as_measured and found[1].row["wall_s"] is None
    else:
        assert "is not as written" in unusable[folder / "trials" / "t1"]


def test_a_trial_that_is_gone_is_forgotten(folder):
    TrialReader(folder).read()
    shutil.rmtree(folder / "trials" / "t1")
    assert [trial.path.name for trial in TrialReader(folder).read()[0]] == ["t0", "t2"]
    assert len(trial_reader._load(folder / ROWS, folder / "trials")) == 2


@pytest.mark.parametrize("damage", ["cut", "flip", "text", "empty", "code", "shape"])
def test_rows_that_are_damaged_or_of_other_code_are_made_again(folder, read, damage):
    first, _ = TrialReader(folder).read()
    file = folder / ROWS
    content = file.read_bytes()
    lines = gzip.decompress(content).splitlines(keepends=True)
    middle = len(content) // 2
    file.write_bytes(
        {
            "cut": content[:-9],
            "flip": content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :],
            "text": b"no rows",
            "empty": b"",
            "code": gzip.compress(b"".join([b"0123456789abcdef\n", *lines[1:]])),
            "shape": gzip.compress(lines[0] + b'["t0", 1]\n'),
        }[damage]
    )
    assert TrialReader(folder).read()[0] == first
    assert len(read) == 6
    assert TrialReader(folder).read()[0] == first
    assert len(read) == 6


def test_a_folder_that_cannot_be_written_is_read(folder, monkeypatch):
    def refuse(_):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(trial_reader, "replacing", refuse)
    assert len(TrialReader(folder).read()[0]) == 3


@pytest.mark.slow
def test_workers_read_many_trials_and_progress_is_shown(folder, monkeypatch):
    alone, steps = [trial.row for trial in TrialReader(folder).read()[0]], []
    (folder / ROWS).unlink()
    (folder / "trials" / "t1" / records.EVENTS).write_text("{}")
    monkeypatch.setattr(trial_reader, "POOL_FROM", 2)
    monkeypatch.setattr(trial_reader, "read_trial", None)  # so that this process can read none
    reader = TrialReader(folder, workers=2, on_read=lambda *numbers: steps.append(numbers))
    found, unusable = reader.read()
    assert [trial.row for trial in found] == [alone[0], alone[2]]
    assert [path.name for path in unusable] == ["t1"]
    assert steps == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.slow
def test_a_batch_reads_nothing_that_its_workers_have_read(tmp_path, monkeypatch):
    def refuse(path):
        raise AssertionError(f"{path} is read again")

    monkeypatch.setattr(trial_reader, "read_trial", refuse)
    person = Distributions.of({"reach": {"mixture": [[1.0, {"uniform": [0.8, 1.1]}]]}})
    design, reports = Design((brief(0), replace(brief(1), person=person))), []
    rows = run_batch(design, tmp_path / "out", workers=1)
    table = (tmp_path / "out/trials.parquet").read_bytes()
    assert run_batch(design, tmp_path / "out", workers=1, on_progress=reports.append) == rows
    assert [(report.resumed, report.done) for report in reports] == [(2, 0)]
    assert (tmp_path / "out/trials.parquet").read_bytes() == table
    assert [row["house_seed"] for row in rows] == [0, 1]
