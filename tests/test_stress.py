"""Stress sessions of walking and carrying, and what their benchmarks require."""

import numpy as np
import pytest

from benchmarks.support import carrying_sessions as carrying
from benchmarks.support import walking_sessions as walking
from experiments.commands.bench import benchmark
from experiments.house import House

WALKING, CARRYING = benchmark("walking"), benchmark("carrying")


@pytest.fixture(scope="module")
def house() -> House:
    return House.load()


@pytest.mark.parametrize(
    "session", [2, 10]
)  # both ran into a gap too narrow for a person before it was closed
def test_running_into_things_neither_passes_nor_wedges(house: House, session: int) -> None:
    result = WALKING.summarise([walking.run_session(house, session)])
    outcomes = list(WALKING.lines(result))[-len(WALKING.REQUIREMENTS) :]
    assert all("pass" in line for line in outcomes), outcomes
    assert result["overlap_max_mm"] > 1.0  # it did run into something
    assert result["retreats"] >= 5


def test_a_session_repeats_to_the_last_bit(house: House) -> None:
    first, again = (walking.run_session(house, 3, seconds=4.0) for _ in range(2))
    assert first == again
    assert first.simulated >= 4.0


def test_two_things_are_carried_through_the_house_at_full_speed(house: House) -> None:
    walks = [carrying.run_session(house, number) for number in range(5)]
    result = CARRYING.summarise(walks)
    outcomes = list(CARRYING.lines(result))[-len(CARRYING.REQUIREMENTS) :]
    assert all("pass" in line for line in outcomes), outcomes
    assert result["arrived"] == len(walks)
    assert max(float(walk.speed.max()) for walk in walks) == pytest.approx(1.4, abs=0.05)


def test_what_goes_wrong_counts_against_the_requirements() -> None:
    walk = walking.WalkResult(
        7, 3.0, 36.0, tunnelled=1, stuck=2, retreats=6, drift=[0.01], turned=[0.1], overlap=[0.01], fastest=9.0,
        ejections=1, object_tunnellings=1, lost=1, error="blew up",
    )  # fmt: skip
    text = list(WALKING.lines(WALKING.summarise([walk])))
    assert sum("FAIL" in line for line in text) == len(WALKING.REQUIREMENTS)
    assert "failed: at 3.0 m/s; --only 7 runs it again" in text
    straight, round_a_corner = np.zeros(4), np.full(4, 2.0)
    carry = carrying.CarryResult(
        0, ("mug", "cap"), 1, True, 8.0, np.full(8, 1.4), np.concatenate([straight, round_a_corner]),
        np.full((8, 2), 0.003), np.full((8, 2), 0.2), np.zeros(8),
    )  # fmt: skip
    text = list(CARRYING.lines(CARRYING.summarise([carry])))
    assert sum("FAIL" in line for line in text) == len(CARRYING.REQUIREMENTS)
