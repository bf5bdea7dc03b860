"""Power over homes and people, against covariances written out and a study drawn many times."""

import numpy as np
import pytest
from study_people import made_up_people, table_of

from experiments.analysis.planning.homes_power import SLOPE, homes_power, power_of_design
from experiments.errors import ConfigError, StatisticsError

VARIANCES = {"person": 0.4, SLOPE: 0.3, "residual": 1.0}


def drawn_power(means, homes, people, trials, studies=600):
    """Share of balanced studies whose F test, with the true variance of a condition's mean, finds the effect."""
    rng, found = np.random.default_rng(3), []
    conditions = len(means)
    where = (np.arange(people)[:, None] + homes // trials * np.arange(trials)) % homes
    for _ in range(studies):
        slope = rng.normal(0, VARIANCES[SLOPE] ** 0.5, (conditions, homes))
        person = rng.normal(0, VARIANCES["person"] ** 0.5, (conditions, people, 1))
        values = person + slope[:, where] + rng.normal(size=(conditions, people, trials))
        found.append(values.mean(axis=(1, 2)) + means)
    variance = np.var(np.array(found) - means, axis=0, ddof=1).mean()
    expected = (VARIANCES["person"] / people) + VARIANCES[SLOPE] / homes + 1 / (people * trials)
    assert variance == pytest.approx(expected, rel=0.12)
    limit = 5.9915 / (conditions - 1)  # of chi squared, as degrees of freedom are many
    return np.mean(np.var(np.array(found), axis=1, ddof=1) / expected > limit)


def test_power_is_that_of_drawn_studies():
    means = np.array([0.0, 0.15, 0.3])
    found = power_of_design(means, VARIANCES, homes=60, people=60, trials=4)
    assert found == pytest.approx(drawn_power(means, 60, 60, 4), abs=0.06)


def test_more_homes_help_where_effects_differ_between_homes_and_more_people_otherwise():
    def power(homes, people, **variances):
        return power_of_design([0.0, 0.3], {**VARIANCES, **variances}, homes, people, trials=4)

    assert power(5, 400) < power(5, 4000) < 0.6 < power(100, 400)
    assert power(100, 40, **{SLOPE: 0.0}) - power(20, 40, **{SLOPE: 0.0}) < 0.01
    assert power_of_design([0.0, 1e-3], VARIANCES, 20, 30, 4) == pytest.approx(0.05, abs=1e-4)


def test_a_pool_that_cannot_tell_and_designs_that_are_none_are_refused():
    table = table_of(made_up_people({("none", 6): 12, ("optimal", 6): 12}))
    with pytest.raises(StatisticsError, match="has no data on the variance of"):
        homes_power(table, "deviations", [20], [10], 2)
    with pytest.raises(ConfigError, match="at least 5 homes"):
        homes_power(table, "deviations", [2], [10], 2)
