"""A disk that fills up: what was simulated is kept, where it should be or else where there is room."""

import contextlib
import errno
import os
import subprocess
import tempfile
from pathlib import Path

import pytest
from msgspec import structs

from experiments.errors import RecordError
from experiments.record import records
from experiments.record.files import read_json
from experiments.session.film_config import FilmConfig
from experiments.trials.replay.replay import replay
from experiments.trials.trial import run_trial
from faults.conftest import BRIEF, FAST


@pytest.fixture
def small_disk(tmp_path):
    """Makes a file system of so many bytes; needs the right to mount one."""
    with contextlib.ExitStack() as stack:

        def make(size):
            folder = tmp_path / "disk"
            folder.mkdir()
            mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "none", str(folder)]
            if os.geteuid() or subprocess.run(mount, capture_output=True).returncode:
                pytest.skip("file systems cannot be mounted here")
            stack.callback(subprocess.run, ["umount", str(folder)], check=True)
            return folder

        yield make


@pytest.mark.parametrize("size", ["4k", "24k", "64k"])
def test_a_run_on_a_full_disk_is_kept_elsewhere(size, house, small_disk, tmp_path, monkeypatch):
    """The disk is full at the event log, at the trajectory, at the recording."""
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    disk = small_disk(size)
    with pytest.raises(RecordError, match=r"No space left on device.*the run is kept in (.*)") as failure:
        run_trial(BRIEF, disk / "out", topdown=False, house=house)
    kept = Path(str(failure.value).rpartition(" ")[2])
    assert read_json(kept / records.METRICS)["ended"] == "all delivered"
    assert replay(kept, house=house).ended == "all delivered"
    assert list(disk.iterdir()) == []


@pytest.mark.slow
def test_a_full_disk_costs_the_video_alone(house, small_disk):
    """The video is by far the largest file."""
    disk, warnings = small_disk("120k"), []
    out, film, brief = disk / "out", FilmConfig(320, 240), structs.replace(BRIEF, time_limit=8.0)
    metrics = run_trial(brief, out, film=film, topdown=False, house=house, on_warning=warnings.append)
    assert metrics["ended"] == "time limit" and metrics["frames_sha256"] is None
    assert len(warnings) == 1 and warnings[0].startswith("no video: ")
    assert not (out / records.VIDEO).exists()
    assert replay(out, house=house).ended == "time limit"


def full(*_args, **_options):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_full_disk_at_the_floor_plan_costs_the_floor_plan_alone(house, tmp_path, monkeypatch):
    monkeypatch.setattr("experiments.trials.trial.draw_topdown", full)
    warnings = []
    run_trial(BRIEF, tmp_path / "out", house=house, on_warning=warnings.append)
    assert warnings == [f"no floor plan: OSError: [Errno 28] No space left on device: '{tmp_path}'"]
    assert replay(tmp_path / "out", house=house).ended == "all delivered"


def test_where_nothing_can_be_written_that_is_said(house, tmp_path, monkeypatch):
    monkeypatch.setattr("experiments.record.writer.save_arrays", full)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with pytest.raises(OSError, match="No space left"):
        run_trial(BRIEF, tmp_path / "out", topdown=False, house=house)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_batch_on_a_full_disk_says_so_and_goes_on_later(small_disk, mjsim):
    disk = small_disk("100k")
    words = ("batch", *FAST, "--assistance", "optimal", "--seeds", "0:2", "--workers", "1", "--out")
    done = mjsim(*words, str(disk / "out"))
    assert done.returncode == 1
    assert "Traceback" not in done.stderr and "No space left" in done.stderr
    subprocess.run(["mount", "-o", "remount,size=10m", str(disk)], check=True)
    assert mjsim(*words, str(disk / "out")).returncode == 0
    assert len((disk / "out" / "trials.csv").read_text().splitlines()) == 3
