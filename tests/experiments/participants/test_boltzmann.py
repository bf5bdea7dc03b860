"""The participant that weighs regrets: exact odds from bounds, optimal when cold, wandering when hot."""

import math

import numpy as np
import pytest

from experiments.errors import ConfigError
from experiments.participants.base import Choice
from experiments.participants.boltzmann import draw
from experiments.participants.registry import participant
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from planner.plan import Visit, VisitKind

TRUE = (0.0, 0.3, 0.8, 2.0, 3.0)
BOUND = (0.0, 0.3, 0.5, 0.5, 0.5)  # the last three are only known to be at least 0.5 m


def choices(asked, unknown=()):
    def exact(k):
        asked.append(k)
        return None if k in unknown else TRUE[k]

    return [
        Choice(Visit(VisitKind.PICK, f"object_{k}"), np.zeros(2), BOUND[k], k > 1, lambda k=k: exact(k))
        for k in range(5)
    ]


@pytest.mark.parametrize(
    ("temperature", "unknown"),
    [(0.0001, ()), (0.001, ()), (0.3, ()), (1.0, ()), (20.0, ()), (1e6, ()), (1.0, (2, 3, 4))],
)
def test_the_odds_are_those_of_the_exact_regrets_and_of_bounds_where_these_cannot_be_had(
    temperature, unknown
):
    rng, count = np.random.default_rng(0), 2000
    drawn = [draw(choices([], unknown), temperature, rng).visit.object for _ in range(count)]
    regrets = np.array([BOUND[k] if k in unknown else TRUE[k] for k in range(5)])
    weights = np.exp(-regrets / temperature)
    expected = weights / weights.sum()
    found = np.array([drawn.count(f"object_{k}") for k in range(5)]) / count
    assert np.abs(found - expected).max() < 4 * math.sqrt(0.25 / count)


def test_what_is_not_likely_is_hardly_ever_worked_out():
    asked, rng = [], np.random.default_rng(1)
    for _ in range(200):
        draw(choices(asked), 0.05, rng)
    assert len(asked) < 10


def test_a_cold_participant_regrets_nothing_and_a_hot_one_walks_more(tmp_path, house):
    cold, hot = (
        run_trial(
            TrialConfig(
                objects=6, assistance="optimal", seed=2, fidelity="event", user=f"boltzmann:{temperature}"
            ),
            tmp_path / temperature,
            topdown=False,
            house=house,
        )
        for temperature in ("0", "30")
    )
    assert (cold["delivered"], hot["delivered"]) == (6, 6)
    assert cold["regretful_visits"] == 0
    assert cold["total_regret_m"] < 0.05  # where one stands when reaching makes a difference of centimetres
    assert hot["regretful_visits"] > 2
    assert hot["total_regret_m"] > 3
    assert hot["nd_feasible"] > cold["nd_feasible"]
    assert hot["task_distance_m"] > cold["task_distance_m"] + 3


@pytest.mark.parametrize("text", ["", "warm", "-1", "nan", "inf"])
def test_a_temperature_is_a_number_of_metres(text):
    with pytest.raises(ConfigError, match="number of metres"):
        participant(f"boltzmann:{text}")


def test_who_takes_no_parameter_says_so():
    with pytest.raises(ConfigError, match="nearest takes no parameter, got '3'"):
        participant("nearest:3")
