"""Regrets in live use: the caller never waits for them, and what was too late is computed after the task."""

import threading

import pytest
from planning_cases import Task, two_rooms

from experiments.session import regrets
from experiments.session.regrets import LiveRegrets, Regrets
from planner.plan import VisitKind
from planner.regret_evaluator import RegretEvaluator
from planner.replanner import Replanner
from planner.solver import solver


@pytest.fixture(scope="module")
def geodesics():
    return two_rooms()


@pytest.fixture
def slow(monkeypatch):
    """An evaluator that answers only when told to."""
    go = threading.Event()
    states = []

    class Slow(RegretEvaluator):
        def all(self, state, plan=None):
            states.append(state)
            go.wait(10)
            return super().all(state, plan)

    monkeypatch.setattr(regrets, "RegretEvaluator", Slow)
    return go, states


def planned(geodesics, task):
    return Replanner(geodesics, solver("exact")).plan(task.state).plan


def test_the_caller_never_waits_and_the_answer_is_that_of_a_run_that_repeats(geodesics, slow):
    go, states = slow
    task = Task(geodesics, 8, 1)
    beside, at_once = LiveRegrets(geodesics), Regrets(geodesics)
    plan = planned(geodesics, task)
    for keeper in (beside, at_once):
        keeper.begin(task.state, plan)
    for _ in range(50):
        assert beside.known() == {}
    assert len(states) == 1  # asked often, worked out once
    go.set()
    beside.wait()
    assert beside.known() == at_once.known() != {}


def test_what_was_worked_out_for_a_state_that_is_past_is_not_shown(geodesics, slow):
    go, _ = slow
    task = Task(geodesics, 6, 2)
    keeper = LiveRegrets(geodesics)
    keeper.begin(task.state, planned(geodesics, task))
    keeper.known()
    task.do(VisitKind.PICK, "object_03")
    keeper.begin(task.state, planned(geodesics, task))
    go.set()
    keeper.known()
    keeper.wait()
    assert (VisitKind.PLACE, "object_03") in keeper.known()
    assert (VisitKind.PICK, "object_03") not in keeper.known()


def test_visits_in_live_use_are_evaluated_after_the_task(geodesics):
    task = Task(geodesics, 7, 3)
    beside, at_once = LiveRegrets(geodesics), Regrets(geodesics)
    expected = []
    for number in range(4):
        plan = planned(geodesics, task)
        stop = list(RegretEvaluator(geodesics).all(task.state))[-1]
        for keeper in (beside, at_once):
            keeper.begin(task.state, plan)
        label = number, ("regret_m",)
        expected.append((label, at_once.evaluate(label, stop)))
        assert beside.evaluate(label, stop) is None
        task.do(*stop)
    assert dict(beside.later()) == pytest.approx(dict(expected), abs=1e-9)
    assert list(beside.later()) == list(at_once.later()) == []


def test_a_better_plan_for_the_same_state_does_not_start_over(geodesics, slow):
    go, states = slow
    task = Task(geodesics, 5, 4)
    keeper = LiveRegrets(geodesics)
    for _ in range(3):
        keeper.begin(task.state, planned(geodesics, task))
        keeper.known()
    go.set()
    keeper.wait()
    assert len(states) == 1
    assert keeper.known()
