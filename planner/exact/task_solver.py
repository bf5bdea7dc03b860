"""The exact planner for the successive states of one task: later plans start from earlier ones."""

from typing import TYPE_CHECKING

from planner.exact.task_table import TaskTable
from planner.exact.warm_start import NOTHING_KNOWN
from planner.plan import Plan
from planner.problem import RoutingProblem
from planner.solver import SolveLimit

if TYPE_CHECKING:
    from planner.exact.solver import ExactSolver


class TaskSolver:
    """Looks plans up in a full table where that is small enough; else starts the search from earlier plans.

    The same sequence of problems gives the same plans. They cost what the plain exact planner's do where both are
    proven; where several are optimal, another of them may be found.

    Args:
        solver: The exact planner.

    Attributes:
        name: Name in run records.
    """

    def __init__(self, solver: "ExactSolver") -> None:
        self.name = solver.name
        self._solver = solver
        self._table = TaskTable(solver)
        self._warm = NOTHING_KNOWN

    def solve(self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None) -> Plan:
        """Plan the rest of a task; see :class:`planner.solver.Solver`."""
        plan = self._table.plan(problem)
        if plan is None and self._warm.multipliers:
            *_, plan = self._solver.improve(problem, seed=seed, limit=limit, warm=self._warm)
        elif plan is None:
            plan = self._solver.solve(problem, seed=seed, limit=limit)
        self._warm = self._warm.updated(problem, plan)
        return plan
