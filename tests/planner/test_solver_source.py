"""Check that plans for successive states, which reuse earlier results, are as short as plans from scratch."""

import pytest
from planning_cases import Task, two_rooms

from planner.checker import check
from planner.exact import full_table
from planner.exact.solver import ExactSolver
from planner.exact.task_search import TASK_WORK, TaskSearch
from planner.plan import Status
from planner.problem import possible_next
from planner.solver_source import SolverSource
from planner.task_problems import TaskProblems

TABLE, SEARCH = ExactSolver(), ExactSolver(table_bytes=0)


@pytest.fixture(scope="module")
def geodesics():
    return two_rooms()


@pytest.mark.parametrize("solver", [TABLE, SEARCH], ids=["table", "search"])
@pytest.mark.parametrize("seed", range(4))
def test_plans_stay_optimal_through_deviations_and_mishaps(geodesics, solver, seed):
    task, problems = Task(geodesics, 10, seed), TaskProblems(geodesics)
    planner, again = SolverSource(geodesics, solver), SolverSource(geodesics, solver)
    for step in range(14):
        problem = problems.problem(task.state)
        plan = planner.plan(task.state, None, shown=False).plan
        check(problem, plan)
        assert plan.status is Status.OPTIMAL
        assert plan.cost == pytest.approx(
            TABLE.solve(problem).cost, abs=2e-3
        )  # distances are rounded to 0.1 mm
        assert (
            again.plan(task.state, None, shown=False).visits == plan.visits
        )  # the same sequence of states gives the same plans
        if step % 3 == 2 or not plan.visits:
            task.misfortune()
        else:
            task.do(*plan.visits[0])


def test_a_table_is_filled_once_while_nothing_is_moved(geodesics, monkeypatch):
    filled, fill = [], full_table.filled_table
    monkeypatch.setattr(full_table, "filled_table", lambda table: filled.append(None) or fill(table))
    task, planner = Task(geodesics, 8, 1), SolverSource(geodesics, TABLE)
    while (plan := planner.plan(task.state, None, shown=False)).visits:
        picks = [visit for visit in plan.visits if visit.object in task.loose and visit.kind == "pick"]
        task.do(*(picks[-1] if picks and len(task.carried) < 2 else plan.visits[0]))
        task.position = task.anywhere()
    assert len(filled) == 1
    task.loose["object_00"] = task.anywhere()  # a delivered object has been moved to another place
    assert planner.plan(task.state, None, shown=False).visits
    assert len(filled) == 2


def test_plans_for_many_objects_come_from_one_search_that_is_never_repeated(geodesics, monkeypatch):
    spent = []
    monkeypatch.setattr(TaskSearch, "spend", lambda _, states: spent.append(states))
    many = ExactSolver(
        table_bytes=0, most_searched=0
    )  # treats every problem as if it had more than 24 objects
    task, source, problems = Task(geodesics, 12, 0), SolverSource(geodesics, many), TaskProblems(geodesics)
    for _ in range(6):
        plan, problem = source.plan(task.state, None, shown=True).plan, problems.problem(task.state)
        check(problem, plan)
        best = TABLE.solve(problem).cost
        assert 0.9 * best < plan.lower_bound <= best + 2e-3
        assert plan.cost < 1.08 * best
        task.do(*list(possible_next(problem))[-1])
    assert 0 < spent[0] <= TASK_WORK
    assert spent[1:] == [0] * 5
