"""Trials outside of full physics: rolled out or stepped, run or replayed, they are the same."""

import numpy as np
import pytest

from benchmarks.support.agreement import run_in_tiers
from experiments.errors import ReplayError
from experiments.files import read_arrays, read_json
from experiments.house import House
from experiments.participants.base import WAIT, Moves
from experiments.participants.visit_executor import VisitExecutor
from experiments.replaying.replay import replay
from experiments.runs import records
from experiments.runs.records import EventLog, read_events
from experiments.session import session as session_module
from experiments.session.user_code import decide
from experiments.trials.setup import prepare_session, trial_episode
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from mjsim.actions import Move
from mjsim.errors import PhysicsError
from mjsim.health.monitor import HealthMonitor
from mjsim.model.scene import compose


@pytest.fixture(scope="module")
def house():
    return House.load()


@pytest.fixture(scope="module", autouse=True)
def frequent_checkpoints():
    """Every 2 s, so that walks are cut short by some."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("experiments.runs.recording.CHECKPOINT_PERIOD", 2.0)
        yield


@pytest.fixture(scope="module")
def event_run(house, tmp_path_factory):
    out = tmp_path_factory.mktemp("event") / "run"
    run_trial(
        TrialConfig(objects=3, assistance="optimal", seed=3, fidelity="event"),
        out,
        topdown=False,
        house=house,
    )
    return out


def played(house, config, *, rollouts, ends="all delivered"):
    """Arrays, log and state hashes of a trial, and how many single control steps its session asked for."""
    scene = compose(trial_episode(config, house), house.catalogue)
    log = EventLog()
    session, world = prepare_session(config, house, scene, log)
    session.rollouts = rollouts
    singles, step = 0, world.step

    def counted(action):
        nonlocal singles
        singles += 1
        return step(action)

    world.step = counted
    assert session.run() == ends
    arrays = {name: array.tobytes() for name, array in session.trajectory.arrays().items()}
    hashes = session.recording.state_hashes()
    return (
        {**arrays, "log": log.events, "log_hash": log.hash, "hashes": hashes.tolist()},
        singles,
        len(hashes),
    )


@pytest.mark.parametrize("fidelity", ["windows", "event"])
@pytest.mark.parametrize(
    ("assistance", "user"),
    [("optimal", "follower"), ("highlight", "follower"), ("none", "follower"), ("none", "boltzmann:3")],
)
def test_rollouts_are_what_stepping_gives(house, fidelity, assistance, user):
    config = TrialConfig(objects=3, assistance=assistance, seed=1, fidelity=fidelity, user=user)
    rolled_out, singles, steps = played(house, config, rollouts=True)
    stepped, all_single, _ = played(house, config, rollouts=False)
    assert {name for name in stepped if stepped[name] != rolled_out[name]} == set()
    assert all_single == steps - 1
    searches = assistance == "none" and user == "follower"
    assert singles < (0.6 if searches else 0.2) * steps


def test_waiting_and_walking_on_in_full_physics_are_what_stepping_gives(house, monkeypatch):
    asked = []
    monkeypatch.setattr(session_module, "decide", lambda *arguments: asked.append(1) or decide(*arguments))
    config = TrialConfig(objects=8, assistance="optimal", seed=1)
    rolled_out, singles, steps = played(house, config, rollouts=True)
    seldom = len(asked)
    stepped, *_ = played(house, config, rollouts=False)
    assert {name for name in stepped if stepped[name] != rolled_out[name]} == set()
    assert singles < 0.8 * steps
    assert seldom < 0.2 * steps


@pytest.mark.parametrize("start", [0.0, 15.0])
def test_a_run_without_physics_replays_from_anywhere(event_run, house, start):
    report = replay(event_run, start=start, house=house)
    assert report.ended == "all delivered"
    assert (report.first > 0) == (start > 0)
    assert report.first + report.steps == len(np.load(event_run / records.TRAJECTORY)["time"])


def test_a_replay_names_the_step_within_a_walk_that_differs(event_run, house, tmp_path):
    """The record says that another way was walked: its hashes fit, the physics does not."""
    copy = tmp_path / "copy"
    copy.mkdir()
    for path in event_run.iterdir():
        (copy / path.name).write_bytes(path.read_bytes())
    for name, array in ((records.RECORDING, "state_hash"), (records.TRAJECTORY, "position")):
        arrays = read_arrays(copy / name)
        arrays[array][40] += np.ones((), arrays[array].dtype)
        np.savez_compressed(copy / name, **arrays)
        with pytest.raises(ReplayError, match="first bad step 40 "):
            replay(copy, house=house)
        (copy / name).write_bytes((event_run / name).read_bytes())
    assert replay(copy, house=house).first == 0


def test_the_fidelity_is_part_of_the_record(event_run):
    start = read_events(event_run / records.EVENTS)[0]
    assert start["fidelity"] == start["world"]["fidelity"] == "event"
    assert read_json(event_run / records.METRICS)["fidelity"] == "event"


def test_a_failure_of_the_physics_within_a_walk_leaves_every_step(house, tmp_path, monkeypatch):
    check = HealthMonitor.check

    def fails_late(self, held):
        if self._rig.data.time > 8.0:
            raise PhysicsError("the physics failed on purpose")
        return check(self, held)

    monkeypatch.setattr(HealthMonitor, "check", fails_late)
    config = TrialConfig(objects=3, assistance="optimal", seed=3, fidelity="windows")
    with pytest.raises(PhysicsError, match="on purpose"):
        run_trial(config, tmp_path / "run", topdown=False, house=house)
    kept = tmp_path / "run"
    last = read_events(kept / records.EVENTS)[-1]
    assert last["reason"] == "physics error"
    assert len(np.load(kept / records.TRAJECTORY)["time"]) == round(last["t"] / 0.04) + 1 > 200
    assert replay(kept, house=house).failure == last["error"]


def test_an_interrupted_run_without_physics_replays(house, tmp_path):
    def interrupt(progress):
        if progress.time > 5.0:
            raise KeyboardInterrupt

    config = TrialConfig(objects=3, assistance="optimal", seed=3, fidelity="event")
    metrics = run_trial(config, tmp_path / "run", topdown=False, house=house, on_progress=interrupt)
    assert metrics["ended"] == "interrupted"
    assert metrics["completion_time_s"] >= metrics["simulated_s"] > 4.0
    assert replay(tmp_path / "run", house=house).ended == "interrupted"


class SimpleFollower:
    """All that an author of a participant has to write."""

    needs = frozenset({"breadcrumb"})

    def __init__(self, house):
        self._executor = VisitExecutor(house)

    def act(self, percept):
        return self._executor.follow(percept, percept.guidance) if percept.guidance else WAIT


def build(house, rng):  # noqa: ARG001 - the interface of participants
    return SimpleFollower(house)


def test_a_participant_of_one_method_is_as_quick_as_a_built_in_one(house):
    theirs, ours = (
        TrialConfig(objects=3, assistance="optimal", seed=1, fidelity="event", user=user)
        for user in (f"{__name__}:build", "follower")
    )
    mine, singles, steps = played(house, theirs, rollouts=True)
    other, *counts = played(house, ours, rollouts=True)
    assert (mine["hashes"], singles, steps) == (other["hashes"], *counts)


class Dancer:
    """Moves in figures, and answers every kind of decision in turn."""

    needs = frozenset()

    def __init__(self):
        self._figure = np.tile([0.3, 0.1, 1.0, 0.0], (7, 1))
        self._asked = 0

    def act(self, percept):
        self._asked = round(percept.time / 0.04)
        if self._asked % 20 < 7:
            return Moves(self._figure[self._asked % 20 :])
        return WAIT if self._asked % 20 < 10 else Move(turn=-1.0)


def dance(house, rng):  # noqa: ARG001 - the interface of participants
    return Dancer()


def test_prepared_moves_are_made_one_by_one_or_at_once(house):
    config = TrialConfig(
        objects=2, assistance="none", seed=1, fidelity="event", user=f"{__name__}:dance", time_limit=10.0
    )
    at_once, singles, steps = played(house, config, rollouts=True, ends="time limit")
    one_by_one, *_ = played(house, config, rollouts=False, ends="time limit")
    assert at_once == one_by_one
    assert singles < 0.75 * steps


def test_the_tiers_deliver_the_same_in_about_the_same_time(house):
    config = TrialConfig(objects=3, assistance="optimal", seed=1)
    ran = run_in_tiers(config, house)
    full = ran["full"]
    assert len(full.delivered) == config.objects
    for other in ran.values():
        assert other.delivered == full.delivered
        assert other.metrics["completion_time_s"] == pytest.approx(
            full.metrics["completion_time_s"], rel=0.03
        )
        assert other.metrics["task_distance_m"] == pytest.approx(full.metrics["task_distance_m"], rel=0.03)
