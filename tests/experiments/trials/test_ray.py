"""Batches on a Ray cluster of several nodes, one of which is killed in the middle."""

import itertools

import pytest

from experiments.record import records
from experiments.record.run_directory import TRIALS
from experiments.trials.batch import RAY, run_batch
from experiments.trials.design import factorial
from experiments.trials.trial_reader import read_trials

ray = pytest.importorskip("ray")
DESIGN = factorial(
    objects=[2], assistance=["optimal"], users=["follower"], seeds=range(4), fidelity="event", regret=False
)


@pytest.fixture
def cluster(monkeypatch):
    """A head without cores, and two nodes with one core each, in processes of their own."""
    monkeypatch.setenv("RAY_worker_niceness", "0")
    monkeypatch.setenv("RAY_raylet_start_wait_time_s", "300")  # a busy machine takes its time
    from ray.cluster_utils import Cluster

    found = Cluster(initialize_head=True, head_node_args={"num_cpus": 0})
    nodes = [found.add_node(num_cpus=1) for _ in range(2)]
    ray.init(address=found.address, log_to_driver=False)
    yield found, nodes
    ray.shutdown()
    found.shutdown()


def written(folder):
    """The bytes of what every trial simulated."""
    names = (records.EVENTS, records.TRAJECTORY, records.RECORDING, records.EPISODE)
    return {
        (path.name, name): (path / name).read_bytes()
        for path, name in itertools.product((folder / TRIALS).iterdir(), names)
    }


def test_a_node_that_is_killed_loses_nobody_and_changes_nothing(cluster, tmp_path):
    found, nodes = cluster
    seen = []

    def kill(progress):
        seen.append(progress)
        if progress.done == 1:
            found.remove_node(nodes[0], allow_graceful=False)

    rows = run_batch(DESIGN, tmp_path / "ray", workers=3, executor=RAY, on_progress=kill)
    assert len(rows) == len(read_trials(tmp_path / "ray")[0]) == len(DESIGN.trials)
    assert [row["person_seed"] for row in rows] == list(range(4))
    assert (seen[-1].done, seen[-1].failed) == (4, 0)
    run_batch(DESIGN, tmp_path / "here", workers=1)
    assert written(tmp_path / "ray") == written(tmp_path / "here")
