"""Batches on a Ray cluster: machines that are lost, differ or share no folder, and processes that are stopped."""

import itertools
import os
import signal
import subprocess
import sys
import time
from contextlib import nullcontext

import pytest
from ray.cluster_utils import Cluster
from user_code import participant

from experiments.errors import ConfigError
from experiments.record import records
from experiments.record.run_directory import TRIALS
from experiments.trials import batch, fingerprint, ray_workers
from experiments.trials.batch import RAY, run_batch
from experiments.trials.design import factorial
from experiments.trials.trial_reader import TrialReader
from mjsim.support.files import ROOT

ONE = {"objects": [2], "assistance": ["optimal"], "fidelity": "event", "regret": False}
DESIGN = factorial(**ONE, users=["follower"], seeds=range(4))
pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("ray")]


@pytest.fixture(scope="module")
def cluster():
    """A head without cores, and two nodes with one core each, in processes of their own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("RAY_worker_niceness", "0")
        patch.setenv("RAY_raylet_start_wait_time_s", "300")  # a busy machine takes its time
        patch.setenv("PYTHONPATH", str(ROOT))
        for name, value in ray_workers.ENVIRONMENT.items():  # Ray reads them when the cluster starts
            patch.setenv(name, value)
        found = Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
        patch.setenv("RAY_ADDRESS", found.address)
        for _ in range(2):
            found.add_node(num_cpus=1)
        yield found
        found.shutdown()


def written(folder):
    """The bytes of what every trial simulated."""
    names = (records.EVENTS, records.TRAJECTORY, records.RECORDING, records.EPISODE)
    return {
        (path.name, name): (path / name).read_bytes()
        for path, name in itertools.product((folder / TRIALS).iterdir(), names)
    }


def test_a_node_that_is_killed_loses_nobody_and_changes_nothing(cluster, tmp_path, capfd):
    seen, notes, node = [], [], cluster.add_node(num_cpus=1)

    def kill(progress):
        seen.append(progress)
        if progress.done == 1:
            cluster.remove_node(node, allow_graceful=False)

    rows = run_batch(DESIGN, tmp_path / "ray", executor=RAY, on_progress=kill, on_note=notes.append)
    assert len(rows) == len(TrialReader(tmp_path / "ray").read()[0]) == len(DESIGN.trials)
    assert [row["person_seed"] for row in rows] == list(range(4))
    assert (seen[-1].done, seen[-1].failed) == (4, 0)
    assert notes[0].startswith("Ray: 3 cores on 3 machines")
    assert "ray" not in "".join(capfd.readouterr())
    run_batch(DESIGN, tmp_path / "here", workers=1)
    assert written(tmp_path / "ray") == written(tmp_path / "here")  # and no work folder or mark is left


@pytest.mark.long
@pytest.mark.usefixtures("cluster")
def test_a_trial_that_kills_its_process_is_tried_twice(tmp_path, own_module, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tries = tmp_path / "tries"
    tries.mkdir()
    own_module(participant(f"open(f'{tries}/{{os.getpid()}}', 'w'); os.kill(os.getpid(), 9)"))
    design, reports = factorial(**ONE, users=["own_code:build", "follower"], seeds=[0]), []
    rows = run_batch(design, tmp_path / "out", executor=RAY, on_progress=reports.append)
    assert [row["user"] for row in rows] == ["follower"]
    assert (reports[-1].done, reports[-1].failed) == (1, 1) and "its process died" in reports[-1].failure
    assert len(list(tries.iterdir())) == 2
    assert not list((tmp_path / "out" / TRIALS).glob(".mjsim-work-*"))


def test_a_machine_with_another_library_is_refused_before_the_first_trial(cluster, tmp_path):
    other = tmp_path / "packages" / "shapely-2.0.0.dist-info"
    other.mkdir(parents=True)
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: shapely\nVersion: 2.0.0\n")
    node = cluster.add_node(num_cpus=1, env_vars={"PYTHONPATH": f"{other.parent}{os.pathsep}{ROOT}"})
    here = fingerprint.code_versions()["shapely"]
    try:
        with pytest.raises(ConfigError, match=f"machine .* shapely is 2.0.0 instead of {here}"):
            run_batch(DESIGN, tmp_path / "out", executor=RAY)
    finally:
        cluster.remove_node(node)
    assert not list((tmp_path / "out" / TRIALS).iterdir())


@pytest.mark.usefixtures("cluster")
def test_a_machine_that_joins_later_is_checked_before_its_first_trial(tmp_path, monkeypatch):
    monkeypatch.setattr(ray_workers._Cluster, "prepare", lambda *_: None)
    monkeypatch.setattr(fingerprint, "code_versions", lambda _=(): {"shapely": "0"})
    with pytest.raises(ConfigError, match=r"shapely is .* instead of 0"):
        run_batch(DESIGN, tmp_path / "out", executor=RAY)
    assert not list((tmp_path / "out" / TRIALS).iterdir())


@pytest.mark.usefixtures("cluster")
def test_a_machine_without_the_folder_is_refused_before_the_first_trial(tmp_path, monkeypatch):
    elsewhere = tmp_path / "only-here" / TRIALS / "work"
    monkeypatch.setattr(batch, "work_folder", lambda _: nullcontext(elsewhere))
    with pytest.raises(ConfigError, match=r"does not share .*only-here .*choose an --out"):
        run_batch(DESIGN, tmp_path / "out", executor=RAY)


@pytest.mark.usefixtures("cluster")
def test_sigterm_ends_the_batch_with_our_line(tmp_path):
    words = "batch --objects 2 --fidelity event --no-regret --assistance optimal --seeds 0:500 --executor ray --out out"
    process = subprocess.Popen(
        [sys.executable, "-m", "mjsim", *words.split()], cwd=tmp_path, stderr=subprocess.PIPE, text=True
    )
    trials, deadline = tmp_path / "out" / TRIALS, time.monotonic() + 200
    while len(list(trials.glob(f"[!.]*/{records.METRICS}"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.05)
    process.terminate()
    _, said = process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGTERM
    ray_line, *progress, our_line = said.splitlines()
    assert all(line.startswith("trials: ") for line in progress)
    assert ray_line.startswith("Ray: 2 cores on 2 machines") and "stopped by SIGTERM" in our_line
    assert len((tmp_path / "out" / "trials.csv").read_text().splitlines()) == len(list(trials.iterdir())) + 1
    assert not list(trials.glob(".*"))


@pytest.mark.long
def test_a_head_that_dies_ends_the_batch_with_an_error(cluster, tmp_path, monkeypatch):
    """The last test of this cluster."""
    monkeypatch.setattr(ray_workers, "HEAD_TIMEOUT_S", 1.0)
    design = factorial(**ONE, users=["follower"], seeds=range(500))

    def kill(progress):
        if progress.done == 1:
            cluster.head_node.kill_gcs_server()

    with pytest.raises(ConnectionError, match=r"the head of the Ray cluster .* does not answer"):
        run_batch(design, tmp_path / "out", executor=RAY, on_progress=kill)
    assert (tmp_path / "out" / "trials.csv").is_file()
