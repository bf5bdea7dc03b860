"""Planners of a user's own: each plan is checked, and what cannot be checked of it is no result."""

import json

import numpy as np
import pytest
from user_code import planner

from experiments.cli.main import main
from experiments.errors import UserCodeError
from experiments.record import records
from experiments.record.files import read_json
from experiments.record.records import read_events
from experiments.session.own_planner import planner_named
from experiments.trials.replay.replay import replay
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from faults.conftest import one_line
from planner.problem_json import problem_from_json
from planner.solvers import solver

# The tour to the nearest first is 14.5 m long, the shortest 11 m.
LINE = [0.0, 2.0, -2.5, 6.0]
PROBLEM = {
    "distances": [[abs(a - b) for b in LINE] for a in LINE],
    "shipments": [{"pickup": 1, "delivery": 1}, {"pickup": 2, "delivery": 2}, {"pickup": 3, "delivery": 3}],
}
WRONG = {
    "return replace(plan, cost=plan.cost / 2)": "m long, not",
    "return replace(plan, cost=plan.cost + 1)": "m long, not",
    "return replace(plan, visits=plan.visits[:-1])": "never done",
    "return replace(plan, visits=plan.visits[::-1])": "not carried",
    "return replace(plan, visits=plan.visits + plan.visits[-1:])": "not carried",
    "return replace(plan, cost=float('nan'))": "Plan.cost must be a finite number, got nan",
    "return replace(plan, lower_bound=float('inf'))": "Plan.lower_bound must be a finite number, got inf",
    "return replace(plan, cost=None)": "Plan.cost must be a finite number, got None",
    "return replace(plan, visits=None)": "Plan.visits must be a tuple of Visit",
    "return replace(plan, visits=('pick',))": "Plan.visits must be a tuple of Visit",
    "object.__setattr__(plan, 'cost', float('nan')); return plan": "Plan.cost must be a finite number",
    "return replace(plan, lower_bound=plan.cost + 1)": "exceeds the cost",
    "return replace(plan, status=Status.INFEASIBLE)": None,
    "return replace(plan, status=Status.OPTIMAL, lower_bound=plan.cost)": None,
    "problem.distances.flags.writeable = True; problem.distances[:] = 0; return replace(plan, cost=0)": "not 0.0",
    "return plan.visits": "it must be a Plan",
    "return None": "answered None",
    "1 / 0": "raised ZeroDivisionError: division by zero",
    "raise SystemExit(0)": "raised SystemExit",
    "raise GeneratorExit": "raised GeneratorExit",
    "raise type('Odd', (BaseException,), {})()": "raised Odd",
}


@pytest.mark.parametrize(("statement", "fault"), WRONG.items())
def test_a_plan_that_does_not_hold_is_refused_in_the_name_of_its_planner(
    statement, fault, tmp_path, own_module, capsys
):
    own_module(planner(statement))
    (tmp_path / "problem.json").write_text(json.dumps(PROBLEM))
    code = main(["plan", str(tmp_path / "problem.json"), "--planner", "own_code:Own"])
    printed = capsys.readouterr()
    if fault is None:  # a claim: what it says of its bound is not taken over
        answer = json.loads(printed.out)
        assert (code, answer["status"], answer["cost"], answer["lower_bound"]) == (0, "feasible", 14.5, 11.0)
        return
    line = one_line(printed.err)
    assert (code, printed.out) == (1, "")
    assert "planner 'own_code:Own'" in line and fault in line and "own_code.py, line" in line


@pytest.mark.parametrize(
    "text", ["1 / 0", "raise SystemExit(0)", "class Own:\n    def __init__(self): 1 / 0"]
)
def test_a_planner_that_cannot_be_made_says_where(text, tmp_path, own_module, capsys):
    own_module(text)
    (tmp_path / "problem.json").write_text(json.dumps(PROBLEM))
    assert main(["plan", str(tmp_path / "problem.json"), "--planner", "own_code:Own"]) == 1
    assert "own_code.py, line" in one_line(capsys.readouterr().err)


CLAIMS = "return replace(plan, status=Status.OPTIMAL, lower_bound=plan.cost)"


def test_regrets_and_bounds_of_a_trial_are_true_whatever_its_planner_claims(house, tmp_path, own_module):
    """The same tours with and without the claim; more objects than are all tried."""
    config = {"objects": 8, "assistance": "optimal", "seed": 3, "fidelity": "event"}
    own_module(planner(CLAIMS))
    told = run_trial(
        TrialConfig(**config, planner="own_code:Own"), tmp_path / "own", topdown=False, house=house
    )
    greedy = run_trial(
        TrialConfig(**config, planner="greedy"), tmp_path / "greedy", topdown=False, house=house
    )
    exact = run_trial(TrialConfig(**config), tmp_path / "exact", topdown=False, house=house)
    names = ("total_regret_m", "max_suggestion_gap_m", "planned_distance_m", "task_distance_m")
    assert [told[name] for name in names] == [greedy[name] for name in names]
    assert told["total_regret_m"] > 0
    assert told["reach_bound_m"] == exact["reach_bound_m"]
    assert replay(tmp_path / "own", house=house).ended == "all delivered"


IMPROVING = """
from dataclasses import replace
from planner.greedy_solver import GreedySolver
from planner.plan import Status
from planner.solvers import solver
class Own:
    def solve(self, problem, *, seed=0, limit=None): ...
    def improve(self, problem, *, seed=0, limit=None):
        plan = GreedySolver().solve(problem)
        {statement}
"""


def improved_by(own_module, statement, problem=PROBLEM):
    """Return the cost, lower bound and status of each plan from a custom planner with the given statements."""
    own_module(IMPROVING.format(statement=statement))
    plans = planner_named("own_code:Own").improve(problem_from_json(json.dumps(problem)))
    return [(plan.cost, plan.lower_bound, plan.status.value) for plan in plans]


def test_plans_that_a_planner_improves_have_bounds_of_ours(own_module):
    better = "yield plan; yield solver('exact').solve(problem)"
    assert improved_by(own_module, better) == [(14.5, 11.0, "feasible"), (11.0, 11.0, "optimal")]
    claimed = "yield replace(plan, status=Status.OPTIMAL)"
    assert improved_by(own_module, claimed) == [(14.5, 11.0, "feasible")]


def test_the_last_plan_of_a_planner_is_yielded_again_with_the_bound_of_the_exact_planner(own_module):
    places = np.random.default_rng(0).uniform(0, 9, 17).tolist()  # more than are all tried
    shipments = [{"pickup": k, "delivery": k + 8} for k in range(1, 9)]
    problem = {"distances": [[abs(a - b) for b in places] for a in places], "shipments": shipments}
    best = solver("exact").solve(problem_from_json(json.dumps(problem))).cost
    (cost, weak, _), last = improved_by(own_module, "yield plan", problem)
    assert weak < best < cost and last == (cost, pytest.approx(best), "feasible")


@pytest.mark.parametrize(
    ("statement", "fault"),
    [
        ("yield plan; yield None", "answered None"),
        ("yield plan; 1 / 0", "raised ZeroDivisionError"),
        ("yield replace(plan, cost=1.0)", "m long, not"),
        ("return\n        yield", "gave no plan"),
        ("return None", "raised TypeError"),
    ],
)
def test_a_planner_that_improves_nothing_valid_is_named(own_module, statement, fault):
    with pytest.raises(UserCodeError, match=fault) as caught:
        improved_by(own_module, statement)
    assert str(caught.value).startswith("planner 'own_code:Own'")


@pytest.mark.parametrize("statement", ["return replace(plan, cost=plan.cost / 2)", "raise SystemExit(0)"])
@pytest.mark.parametrize("after", [0, 2])
def test_a_trial_ends_with_the_error_of_its_planner_and_is_kept(
    statement, after, house, tmp_path, own_module
):
    """At the start, or where it is asked anew after deviations."""
    own_module(planner(statement, after))
    config = TrialConfig(
        objects=4,
        assistance="highlight",
        seed=3,
        fidelity="event",
        regret=False,
        user="nearest",
        planner="own_code:Own",
    )
    with pytest.raises(UserCodeError, match=r"planner 'own_code:Own'.*kept for"):
        run_trial(config, tmp_path / "out", topdown=False, house=house)
    assert read_json(tmp_path / "out" / records.METRICS)["ended"] == "error"
    assert read_events(tmp_path / "out" / records.EVENTS)[-1]["error"].startswith("planner 'own_code:Own'")
