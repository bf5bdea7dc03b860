"""Trials in both tiers: in many control steps at once or in single ones, run or replayed, they are the same."""

import itertools

import numpy as np
import pytest
from msgspec import structs
from sessions import prepared

from benchmarks.support.agreement import run_in_tiers
from experiments.participants.visit_executor import VisitExecutor
from experiments.record import records
from experiments.record.records import read_events
from experiments.trials.replay.replay import replay
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from mjsim.values.actions import WAIT, Move, Wait
from mjsim.values.errors import PhysicsError
from mjsim.world.health.monitor import HealthMonitor


@pytest.fixture(scope="module", autouse=True)
def frequent_checkpoints():
    """Every 2 s, so that walks are cut short by some."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("experiments.record.writer.CHECKPOINT_PERIOD", 2.0)
        yield


def played(house, config, prepare=lambda _: None):
    """Arrays, log and state hashes of a trial, how many actions its session took, and in how many control steps."""
    session, world, _ = prepared(house, config)
    prepare(world)
    actions, step = 0, world.step

    def counted(action, limit):
        nonlocal actions
        actions += 1
        return step(action, limit)

    world.step = counted
    assert session.run() == ("time limit" if config.user.endswith(":pause") else "all delivered")
    record = session.record.record()
    arrays = {name: array.tobytes() for name, array in {**record.trajectory, **record.recording}.items()}
    return {**arrays, "log": record.log}, actions, record.steps - 1


class Pauser:
    """Turns for a while, stands for a while, over and over."""

    needs = frozenset()

    def act(self, percept):
        number = round(percept.time / 0.04)
        pause = 0.04 * (number - number % 20 + 10)
        return Wait(pause) if number % 20 < 10 else Move(turn=-1.0)


def pause(house, rng):  # noqa: ARG001 - the interface of participants
    return Pauser()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("assistance", "user", "fidelity"),
    [
        ("none", "boltzmann:3", "event"),
        ("none", f"{__name__}:pause", "event"),
        *itertools.product(["none", "highlight", "optimal"], ["follower", "guest"], ["event"]),
        ("optimal", "follower", "full"),
    ],
)
def test_many_steps_at_once_are_what_single_ones_give(house, assistance, user, fidelity, step_singly):
    config = TrialConfig(objects=3, assistance=assistance, seed=1, fidelity=fidelity, user=user)
    if user.endswith(":pause"):  # who puts nothing away
        config = structs.replace(config, time_limit=60.0)
    at_once, actions, steps = played(house, config)
    stepped, all_actions, _ = played(house, config, step_singly)
    assert {name for name in stepped if stepped[name] != at_once[name]} == set()
    assert all_actions == steps
    if user != "guest":
        turns = assistance == "none" and user != "boltzmann:3"
        assert actions < (0.6 if turns else 0.2) * steps


def test_a_run_without_physics_replays_from_anywhere(house, tmp_path):
    config = TrialConfig(objects=3, assistance="optimal", seed=3, fidelity="event")
    assert run_trial(config, tmp_path / "run", topdown=False, house=house)["fidelity"] == "event"
    for start in (0.0, 15.0):
        report = replay(tmp_path / "run", start=start, house=house)
        assert report.ended == "all delivered"
        assert (report.first > 0) == (start > 0)
        assert report.first + report.steps == len(np.load(tmp_path / "run" / records.TRAJECTORY)["time"])


def test_a_failure_of_the_physics_within_a_walk_leaves_every_step(house, tmp_path, monkeypatch):
    check = HealthMonitor.check

    def fails_late(self, held):
        if self._rig.data.time > 8.0:
            raise PhysicsError("the physics failed on purpose")
        return check(self, held)

    monkeypatch.setattr(HealthMonitor, "check", fails_late)
    config = TrialConfig(objects=3, assistance="optimal", seed=3, fidelity="full")
    with pytest.raises(PhysicsError, match="on purpose"):
        run_trial(config, tmp_path / "run", topdown=False, house=house)
    kept = tmp_path / "run"
    last = read_events(kept / records.EVENTS)[-1]
    assert last["reason"] == "physics error"
    assert len(np.load(kept / records.TRAJECTORY)["time"]) == round(last["t"] / 0.04) + 1 > 200
    assert replay(kept, house=house).failure == last["error"]


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
    mine, actions, steps = played(house, theirs)
    other, *counts = played(house, ours)
    assert (mine["state_hash"], actions, steps) == (other["state_hash"], *counts)


def test_the_tiers_deliver_the_same_in_about_the_same_time(house):
    config = TrialConfig(objects=3, assistance="optimal", seed=1)
    ran = run_in_tiers(config, house)
    full, event = ran["full"], ran["event"]
    assert len(full.delivered) == config.objects
    assert event.delivered == full.delivered
    for name in ("completion_time_s", "task_distance_m"):
        assert event.metrics[name] == pytest.approx(full.metrics[name], rel=0.03)


@pytest.mark.slow
def test_objects_are_put_down_at_the_same_places_in_both_tiers(house):
    """Objects of several sizes, each in its free place in the bin: at most 5 mm apart."""
    places = []
    for fidelity in ("event", "full"):
        config = TrialConfig(objects=8, assistance="optimal", user="follower", seed=4, fidelity=fidelity)
        session, world, _ = prepared(house, config)
        assert session.run() == "all delivered"
        places.append(world.observation().object_positions)
    assert np.abs(places[0] - places[1]).max() < 0.005
