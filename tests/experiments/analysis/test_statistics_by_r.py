"""Every statistic of a report against R: by_r/statistics.R made by_r/expected.json from by_r/people.csv."""

import csv
import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from study_people import table_of

from experiments.analysis.comparison import mean_interval
from experiments.analysis.statistics.anova import (
    EFFECTS,
    brown_forsythe,
    hc3,
    one_way,
    two_way,
    welch,
    welch_james,
)
from experiments.analysis.statistics.effects import detectable_eta_squared
from experiments.analysis.statistics.mixed import mixed_model
from experiments.analysis.statistics.mixtures import fit_mixtures
from experiments.analysis.statistics.models import diagnose, ordinal_model
from experiments.analysis.statistics.pairs import compare_pairs
from studies.score_rules import _below, _trend

BY_R = Path(__file__).parent / "by_r"
R = json.loads((BY_R / "expected.json").read_text())
CONDITIONS = ("none", "highlight", "optimal")
with (BY_R / "people.csv").open() as file:
    PEOPLE = list(csv.DictReader(file))
condition, houses = (np.array([row[name] for row in PEOPLE]) for name in ("assistance", "house"))
objects, y, answers, accepted, visits = (
    np.array([float(row[name]) for row in PEOPLE])
    for name in ("objects", "y", "answer", "accepted", "visits")
)
SIX = {c: y[(condition == c) & (objects == 6)] for c in CONDITIONS}
CELLS = {
    f"{c}, {n:.0f}": y[(condition == c) & (objects == n)] for c in CONDITIONS for n in np.unique(objects)
}


def f_test(test):
    return {"statistic": test.statistic, "df1": test.df1, "df2": test.df2, "p": test.p}


def effects(tests):
    return {effect: f_test(tests[effect]) for effect in EFFECTS}


def of_diagnostics():
    found = diagnose(CELLS)
    same = {name: getattr(found, name) for name in ("shapiro_wilk", "shapiro_wilk_p", "skewness", "kurtosis")}
    ends = {"largest": found.largest_deviation[1], "smallest": found.smallest_deviation[1]}
    return same | {"equal_variances": f_test(found.equal_variances)} | ends


def of_pairs():
    names = list(R["pairs"][0])
    return [{name: asdict(pair)[name] for name in names} for pair in compare_pairs(SIX, 0.5)]


def of_answers():
    model = ordinal_model({c: answers[(condition == c) & (objects == 6)] for c in CONDITIONS})
    return asdict(model.test) | {"ratios": list(model.odds_ratios.values())}


def of_mixtures():
    fits = {len(m.shares): m.log_likelihood for m in fit_mixtures(accepted.astype(int), visits.astype(int))}
    return [fits[1], fits[2]]


def mixed():
    return mixed_model(y, condition, objects, {"house": houses})


def variances():
    return [mixed().random["house"].variance, mixed().residual_variance]


def crossed():
    with (BY_R / "crossed.csv").open() as file:
        rows = list(csv.DictReader(file))
    values, shown, house = (np.array([row[name] for row in rows]) for name in ("y", "assistance", "house"))
    factors = {name: np.array([row[name] for row in rows]) for name in ("person", "house", "trial_number")}
    factors["pair"] = np.char.add(house, shown)
    return mixed_model(values.astype(float), shown, np.full(len(rows), 6), factors)


def crossed_variances():
    model = crossed()
    found = {name: factor.variance for name, factor in model.random.items()}
    return found | {"Residual": model.residual_variance}


OURS = {
    "one_way": lambda: f_test(one_way(SIX)),
    "welch": lambda: f_test(welch(SIX)),
    "brown_forsythe": lambda: f_test(brown_forsythe(SIX)),
    "hc3_one_way": lambda: f_test(
        hc3(y[objects == 6], condition[objects == 6], objects[objects == 6])["assistance"]
    ),
    "eta_interval": lambda: one_way(SIX).interval,
    "eta_equivalence_p": lambda: one_way(SIX).p_of_equivalence(0.06),
    "detectable": lambda: detectable_eta_squared(2, 39, 42),
    "mean_intervals": lambda: {c: mean_interval(SIX[c]) for c in CONDITIONS},
    "type_2": lambda: effects(two_way(y, condition, objects)),
    "type_3": lambda: effects(two_way(y, condition, objects, kind=3)),
    "hc3": lambda: effects(hc3(y, condition, objects)),
    "welch_james": lambda: effects(welch_james(y, condition, objects)),
    "diagnostics": of_diagnostics,
    "pairs": of_pairs,
    "ordinal": of_answers,
    "mixed": lambda: effects(mixed().tests),
    "mixed_variances": variances,
    "crossed": lambda: f_test(crossed().tests["assistance"]),
    "crossed_variances": crossed_variances,
    "mixtures": of_mixtures,
}
# lmer climbs to 1e-8 of the variances; Shapiro and Wilk's coefficients are approximations of six digits.
TOLERANCES = {
    "mixed": 1e-6,
    "mixed_variances": 1e-6,
    "crossed": 1e-5,
    "crossed_variances": 1e-5,
    "diagnostics": 1e-6,
}


def assert_equal(ours, theirs, tolerance, where):
    if isinstance(theirs, dict):
        assert set(ours) == set(theirs)
        for name in theirs:
            assert_equal(ours[name], theirs[name], tolerance, f"{where} {name}")
    elif isinstance(theirs, list):
        for k, (one, other) in enumerate(zip(ours, theirs, strict=True)):
            assert_equal(one, other, tolerance, f"{where} {k}")
    else:
        assert ours == pytest.approx(theirs, rel=tolerance, abs=1e-10), where


@pytest.mark.slow
@pytest.mark.parametrize("name", OURS)
def test_a_statistic_is_that_of_r(name):
    assert_equal(OURS[name](), R[name], TOLERANCES.get(name, 1e-8), name)


def test_the_scores_orders_and_trends_decide_as_r():
    rows = [
        {"objects": int(n), "assistance": c, "user": "follower", "nd_feasible": v / 10}
        for n, c, v in zip(objects, condition, np.clip(y, 0, 10), strict=True)
    ]
    table = table_of(rows)
    assert _trend(table, "deviations", "none") == (R["trend_p"] < 0.05)
    pairs = (("none", "highlight"), ("none", "optimal"), ("highlight", "optimal"))
    for (first, second), p, gap in zip(pairs, R["below_p"], R["below_difference"], strict=True):
        assert _below(table, "deviations", second, first) == (p < 0.05 and gap > 0)
        assert _below(table, "deviations", first, second) == (p < 0.05 and gap < 0)
