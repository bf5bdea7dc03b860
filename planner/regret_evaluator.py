"""Regrets of visits for the successive states of one task."""

from planner.exact.solver import ExactSolver
from planner.exact.task_table import TaskTable
from planner.exact.warm_start import NOTHING_KNOWN
from planner.geodesics import Geodesics
from planner.plan import Plan, Status, Visit
from planner.problem import RoutingProblem
from planner.regret import RADIUS, Regret, after, ranked, regrets
from planner.route import TaskState
from planner.solver import SolveLimit
from planner.task_problems import TaskProblems
from planner.tour import possible_next, tour_length

SAME = 1e-6  # m


class RegretEvaluator:
    """Evaluates possible and actual visits, always with the exact planner; results repeat bit for bit.

    Args:
        geodesics: Distances.
        solver: The exact planner as it is to be; None for the usual one.
        capacity: How many objects can be carried.
        limit: Of each search, beyond 18 objects left; None for the planner's own budget of work.
        radius: `all` gives regrets up to here exactly, m.
    """

    def __init__(
        self,
        geodesics: Geodesics,
        *,
        solver: ExactSolver | None = None,
        capacity: int = 2,
        limit: SolveLimit | None = None,
        radius: float = RADIUS,
    ) -> None:
        self._solver = solver or ExactSolver()
        self._problems = TaskProblems(geodesics, capacity)
        self._table = TaskTable(self._solver)
        self._limit = limit
        self._radius = radius
        self._last: tuple[TaskState, dict[Visit, Regret]] | None = None

    def all(self, state: TaskState, plan: Plan | None = None) -> dict[Visit, Regret]:
        """What each possible next visit costs compared with the best one, the best first.

        Args:
            state: The task as it is now.
            plan: What was planned for this state or before it; if it is proven and of this state, no other is searched.

        Raises:
            UnreachableError: Objects that cannot be fetched or delivered; `names` lists them.
            ProblemError: More is carried than the capacity allows.
        """
        if self._last is None or not same_state(self._last[0], state):
            problem = self._problems.problem(state)
            costs = self._table.costs(problem)
            if costs is not None:
                found = ranked(problem, *costs)
            else:
                best = plan if plan is not None and _is_best(plan, problem) else None
                found = regrets(problem, self._solver, limit=self._limit, radius=self._radius, plan=best)
            self._last = state, {regret.visit: regret for regret in found}
        return dict(self._last[1])

    def of(self, state: TaskState, visit: Visit, plan: Plan | None = None) -> float | None:
        """By how much a visit makes the rest of the task longer than the best one does, m.

        Args:
            state: The task before the visit.
            visit: The visit.
            plan: As in `all`.

        Returns:
            The exact regret, however large; None where the visit is not possible or nothing is proven.
        """
        if self._last is not None and same_state(self._last[0], state):
            known = self._last[1].get(visit)
            if known is not None and known.proven and not known.capped:
                return known.regret
        problem = self._problems.problem(state)
        if visit not in possible_next(problem):
            return None
        costs = self._table.costs(problem)
        if costs is not None:
            return next(regret.regret for regret in ranked(problem, *costs) if regret.visit == visit)
        before = plan if plan is not None and _is_best(plan, problem) else self._solve(problem)
        rest = self._after(problem, visit, before)
        if not before.status is rest.status is Status.OPTIMAL:
            return None
        leg = float(problem.distances[problem.start, problem.location(visit)])
        return max(0.0, leg + rest.cost - before.cost)

    def _solve(self, problem: RoutingProblem) -> Plan:
        return self._solver.solve(problem, limit=self._limit)

    def _after(self, problem: RoutingProblem, visit: Visit, before: Plan) -> Plan:
        """The best plan after a visit; starting from the plan before it halves the work."""
        warm = NOTHING_KNOWN.updated(problem, before)
        *_, best = self._solver.improve(after(problem, visit), limit=self._limit, warm=warm)
        return best


def _is_best(plan: Plan, problem: RoutingProblem) -> bool:
    """Whether a plan is proven and of this problem, not of an earlier state of the task."""
    visits = {problem.place(k) for k in range(len(problem.names))}
    visits |= {problem.pick(k) for k in range(len(problem.shipments))}
    if plan.status is not Status.OPTIMAL or set(plan.visits) != visits:
        return False
    return abs(tour_length(problem, plan.visits) - plan.cost) <= SAME


def same_state(one: TaskState, other: TaskState) -> bool:
    """Whether the person and all objects are at the same place in both states."""
    return one is other or (one.position, one.carried, one.loose) == (
        other.position,
        other.carried,
        other.loose,
    )
