"""Data that a statistical method cannot analyse are refused, and the least data that it can analyse are not."""

import numpy as np
import pytest

from experiments.analysis.statistics.anova import hc3, two_way, two_way_squares, welch, welch_james
from experiments.analysis.statistics.effects import MAX_PEOPLE, people_per_cell, power_of
from experiments.analysis.statistics.mixed import differences_by_house, mixed_model
from experiments.analysis.statistics.mixtures import MIN_PEOPLE, fit_mixtures
from experiments.analysis.statistics.models import ordinal_model
from experiments.analysis.statistics.pairs import tukey_differs
from experiments.errors import StatisticsError

VALUES = np.array([1.0, 2.0, 4.0, 3.0, 5.0, 9.0, 2.0, 7.0])
FIRST, SECOND = np.repeat([*"ab"], 4), np.tile([6, 6, 12, 12], 2)


def refused(call, message):
    with pytest.raises(StatisticsError, match=message):
        call()


def test_each_group_of_a_test_without_equal_variances_needs_two_values_that_differ():
    assert welch({"a": VALUES[:2], "b": VALUES}).df1 == 1
    refused(lambda: welch({"a": VALUES[:1], "b": VALUES}), "a has 1 known values, 2 are needed")
    refused(lambda: welch({"a": VALUES, "b": np.ones(2)}), "the values of b do not vary")


@pytest.mark.parametrize("method", [welch_james, hc3])
def test_each_cell_of_a_test_without_equal_variances_needs_two_values_that_differ(method):
    assert method(VALUES, FIRST, SECOND)["interaction"].people == 8
    refused(lambda: method(VALUES[1:], FIRST[1:], SECOND[1:]), "a cell has only one person")
    constant = np.where((FIRST == "b") & (SECOND == 12), 3.0, VALUES)
    refused(lambda: method(constant, FIRST, SECOND), "the values of a cell do not vary")


@pytest.mark.parametrize("method", [two_way, two_way_squares])
def test_an_analysis_of_two_factors_needs_two_levels_of_each(method):
    refused(lambda: method(VALUES, np.repeat("a", 8), SECOND), "only one level \\(a\\)")
    refused(lambda: method(VALUES, FIRST, np.full(8, 6)), "only one level \\(6\\)")


def test_an_effect_that_needs_too_many_people_is_refused():
    refused(lambda: people_per_cell(1e-9, 2, 3), f"more than {MAX_PEOPLE} people in each cell")
    largest = power_of(1e-6, 2, 3 * (MAX_PEOPLE - 1), 3 * MAX_PEOPLE)
    assert people_per_cell(1e-6, 2, 3, power=largest) == MAX_PEOPLE
    refused(lambda: people_per_cell(1e-6, 2, 3, power=largest + 1e-6), f"more than {MAX_PEOPLE}")


def test_the_difference_between_conditions_by_house_needs_trials_in_each_cell():
    houses, condition = np.arange(24) % 6, np.repeat([*"abab"], 6)
    objects, values = np.repeat([6, 6, 12, 12], 6), np.random.default_rng(0).normal(size=24)
    (found,) = differences_by_house(values, condition, objects, houses, ["a", "b"])
    assert np.isfinite(found.interval).all()
    few = slice(0, 18)  # without b at 12 objects
    refused(
        lambda: differences_by_house(values[few], condition[few], objects[few], houses[few], ["a", "b"]),
        "a condition has no trials at some number of objects",
    )


def test_a_covariate_that_does_not_vary_is_refused():
    houses, condition, levels = np.repeat(np.arange(10), 4), np.tile([*"ab"], 20), np.full(40, 6)
    values = np.random.default_rng(0).normal(size=40)
    age = ("age", np.full(40, 30.0))
    refused(lambda: mixed_model(values, condition, levels, {"house": houses}, age), "age is the same")


def test_kinds_of_people_are_told_apart_from_the_least_number_of_people_on():
    visits = np.full(MIN_PEOPLE, 4)
    accepted = np.arange(MIN_PEOPLE) % 5  # from none to all of the visits
    assert len(fit_mixtures(accepted, visits)[0].shares) >= 1
    refused(lambda: fit_mixtures(accepted[1:], visits[1:]), f"needs at least {MIN_PEOPLE} people")
    for wrong, of in ((-1, 4), (5, 4), (0, 0)):
        counts, numbers = accepted.copy(), visits.copy()
        counts[3], numbers[3] = wrong, of
        refused(lambda: fit_mixtures(counts, numbers), "below 0 or above the number")  # noqa: B023 - called at once


def test_answers_that_cannot_be_compared_are_refused():
    refused(lambda: ordinal_model({"a": VALUES}), "only one group")
    refused(lambda: ordinal_model({"a": np.ones(4), "b": np.ones(4)}), "all answers are the same")
    refused(lambda: ordinal_model({"a": np.ones(4), "b": np.full(4, 2.0)}), "does not converge")


def test_a_difference_from_a_group_without_people_is_refused():
    for pair in (("a", "c"), ("c", "a")):
        refused(lambda: tukey_differs({"a": VALUES, "b": VALUES + 1.0}, *pair), "no people in c")  # noqa: B023
