"""The worked example on planner slack: what it counts, on logs that can be worked out by hand."""

import pytest

from planner.solvers import solver
from studies.examples import planner_slack


def visit(deviated, own, suggested, alternatives=2):
    return {
        "event": "visit",
        "deviated": deviated,
        "regret_m": own,
        "suggested_regret_m": suggested,
        "alternatives": alternatives,
    }


LOG = [
    {"event": "start", "user": "guest"},
    visit(False, 0.0, 0.0),
    visit(True, 1.0, 0.0),  # worse than a perfect suggestion
    visit(True, 0.0, 0.4),  # better than a poor one
    visit(False, 0.2, 0.2),
    visit(True, 9.0, 9.0, alternatives=0),  # no choice
    visit(True, None, 0.0),  # not known
]


def test_deviations_to_something_better_are_told_apart():
    slack = planner_slack._slack("none", 6, "ortools", [LOG])
    assert (slack.choices, slack.deviations, slack.better) == (4, 0.5, 0.25)
    assert slack.worse_suggestions == 0.5
    assert slack.suggestion_gap_m == pytest.approx(0.15)
    assert slack.person_regret_m == pytest.approx(0.3)


def test_everybody_does_the_task_with_every_planner():
    trials = planner_slack.design(2, (6, 12)).trials
    assert len(trials) == 2 * 2 * 2 * 4
    by_planner = {
        name: [(t.assistance, t.objects, t.person_seed) for t in trials if t.planner == name]
        for name in planner_slack.PLANNERS
    }
    assert len({tuple(people) for people in by_planner.values()}) == 1
    assert solver(planner_slack.HURRIED).name == "ortools-hurried"
