"""`mjsim bench physics`: what it times is what a trial did, and the raw engine goes the same way."""

from typing import Any

import numpy as np
import pytest

from experiments.commands.bench import benchmark
from experiments.house import House
from mjsim.options import FIDELITIES


@pytest.fixture(scope="module")
def physics() -> Any:
    return benchmark("physics")


@pytest.fixture(scope="module")
def house() -> House:
    return House.load("apartment")


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_a_trial_is_played_as_it_was_recorded(physics: Any, house: House, fidelity: str) -> None:
    trial = physics.record_trial(house, 2, 1, fidelity, seconds=15.0)
    worlds = [trial.world() for _ in range(2)]
    for world in worlds:
        assert physics.play(world, trial.calls) > 0
    assert worlds[0].state_hash() == worlds[1].state_hash()
    assert worlds[0].observation().time == pytest.approx(15.0, abs=1e-6)
    assert "restore" in {name for name, _ in trial.calls}
    assert ("walk" in {name for name, _ in trial.calls}) == (fidelity != "full")


def test_the_raw_engine_takes_the_same_steps(physics: Any, house: House) -> None:
    trial = physics.record_trial(house, 2, 1, "full", seconds=15.0)
    row = physics.measure_overhead(trial, 1)  # raises where the two part
    assert row["objects"] == 2
    assert row["ratio"] == pytest.approx(row["step_us"] / row["raw_us"])
    assert row["ratio"] > 1.0
    assert 1.0 <= row["awake"] <= 3.0


def test_the_raw_engine_in_another_state_is_noticed(
    physics: Any, house: House, monkeypatch: pytest.MonkeyPatch
) -> None:
    trial = physics.record_trial(house, 2, 1, "full", seconds=1.0)
    found, *rest = physics.engine_inputs(trial)
    found[5].ctrl[0] += 1.0
    monkeypatch.setattr(physics, "engine_inputs", lambda _: (found, *rest))
    with pytest.raises(RuntimeError, match="different states"):
        physics.measure_overhead(trial, 1)


def test_memory_and_profile_are_measured(physics: Any, house: House) -> None:
    trial = physics.record_trial(house, 1, 0, "full", seconds=2.0)
    memory = physics.measure_memory(trial.scene, 3)
    assert memory["world_mb"] < 20
    profile = physics.measure_profile(trial)
    assert not profile or sum(profile.values()) == pytest.approx(1.0)


def test_the_outcomes_follow_the_targets(physics: Any) -> None:
    result = {
        "objects": 24,
        "tiers": [
            {"fidelity": f, "speed": s} for f, s in zip(FIDELITIES, (130.0, 400.0, 3500.0), strict=True)
        ],
        "overhead": [
            {"objects": 24, "step_us": 250.0, "raw_us": 200.0, "ratio": 1.25, "awake": 2.0, "contacts": 1.0}
        ],
        "memory": {"world_mb": 0.3, "model_mb": 12.0},
        "set_up": {"sample_ms": 1.0, "compose_ms": 1.0, "world_ms": 1.0},
        "profile": {"Python": 0.2},
    }
    outcomes = [word for line in physics.lines(result) for word in ("pass", "FAIL") if word in line]
    assert outcomes == ["pass", "FAIL", "pass", "pass"]
    assert np.all([isinstance(line, str) for line in physics.lines(result)])
