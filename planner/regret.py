"""Compute the regrets of visits, which are the extra tour lengths compared with the best next visit."""

import math
from dataclasses import dataclass, replace

from planner.errors import ProblemError
from planner.exact.instance import make_instance
from planner.exact.multipliers import first_bound, grown, warm_bound
from planner.exact.solver import ExactSolver
from planner.exact.table_regret import Costs, costs_by_pass, costs_in
from planner.exact.task_table import TaskTable
from planner.exact.warm_start import NOTHING_KNOWN
from planner.geodesics import Geodesics
from planner.plan import Plan, Status, Visit, VisitKind
from planner.problem import RoutingProblem, possible_next, tour_length
from planner.route import TaskState
from planner.solvers import Deadline, SolveLimit, Solver
from planner.task_problems import TaskProblems

RADIUS = 1.0  # default limit up to which regrets are computed exactly, in metres
MIN_RADIUS = 0.1  # smallest radius of a pass in metres
MAX_ROWS = 1 << 14  # maximum number of rows in the lower-bound table of a pass
MAX_STATES = 3_000_000  # maximum number of states in a pass, which occupy about 200 MB
SAME = 1e-6  # difference up to which two tour lengths count as equal, in metres


@dataclass(frozen=True)
class Regret:
    """The regret of a possible next visit."""

    visit: Visit
    cost: float  # length of the remaining tour in metres if this visit is next
    regret: float  # extra length in metres compared with the best visit
    proven: bool  # True if cost and regret are proven values, or proven bounds if `capped`
    capped: bool = False  # True if cost and regret are only lower bounds


class RegretEvaluator:
    """An evaluator that computes the regrets of visits with the exact planner.

    `limit` applies to searches with more than 18 remaining objects. By default, the solver's limit applies.
    Results are reproducible unless time is limited. `all` computes regrets of up to `radius` metres exactly.
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
        self._geodesics, self._capacity = geodesics, capacity
        self._solver = solver or ExactSolver()
        self._problems = TaskProblems(geodesics, capacity)
        self._table = TaskTable(self._solver)
        self._limit, self._radius = limit, radius
        self._last: tuple[TaskState, dict[Visit, Regret]] | None = None

    def limited(self, limit: SolveLimit) -> "RegretEvaluator":
        """Return a copy of this evaluator with a limit on each search, for use in another thread."""
        return RegretEvaluator(
            self._geodesics, solver=self._solver, capacity=self._capacity, limit=limit, radius=self._radius
        )

    def all(self, state: TaskState, plan: Plan | None = None) -> dict[Visit, Regret]:
        """Return the regret of each possible next visit, starting with the best visit.

        `plan` is a plan for this state or for an earlier one. A proven plan for this state saves a search.
        Raises UnreachableError if objects cannot be fetched or delivered.
        """
        if self._last is None or not same_state(self._last[0], state):
            problem = self._problems.problem(state)
            costs = self._table.costs(problem)
            if costs is not None:
                found = _ranked(problem, *costs)
            else:
                best = plan if plan is not None and _is_best(plan, problem) else None
                found = _beyond_table(problem, self._solver, self._limit, self._radius, best)
            self._last = state, {regret.visit: regret for regret in found}
        return dict(self._last[1])

    def of(self, state: TaskState, visit: Visit, plan: Plan | None = None) -> float | None:
        """Return the exact regret of a visit in metres, or None if no exact regret is available.

        `plan` is a plan for this state or an earlier one, or None. Raises UnreachableError if objects cannot be fetched
        or delivered.
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
            return next(regret.regret for regret in _ranked(problem, *costs) if regret.visit == visit)
        before = plan if plan is not None and _is_best(plan, problem) else None
        before = before or self._solver.solve(problem, limit=self._limit)
        warm = NOTHING_KNOWN.updated(problem, before)  # a warm start halves the time
        *_, rest = self._solver.improve(after(problem, visit), limit=self._limit, warm=warm)
        if not before.status is rest.status is Status.OPTIMAL:
            return None
        leg = float(problem.distances[problem.start, problem.location(visit)])
        return max(0.0, leg + rest.cost - before.cost)


def same_state(one: TaskState, other: TaskState) -> bool:
    """Return True if the person and all objects are in the same places in both states."""
    return one is other or (one.position, one.carried, one.loose) == (
        other.position,
        other.carried,
        other.loose,
    )


def after(problem: RoutingProblem, visit: Visit) -> RoutingProblem:
    """Return the problem that remains after a visit. Raises ProblemError if the visit is not possible."""
    if visit not in possible_next(problem):
        raise ProblemError(f"{visit} is not possible now; choose one of possible_next")
    shipments, onboard = list(problem.shipments), list(problem.onboard)
    names, number = list(problem.names), problem.number[visit.object]
    name = names.pop(number)
    if visit.kind is VisitKind.PICK:
        onboard.append(shipments.pop(number).delivery)
        names.append(name)
    else:
        onboard.pop(number - len(shipments))
    start = problem.location(visit)
    return replace(
        problem, start=start, shipments=tuple(shipments), onboard=tuple(onboard), names=tuple(names)
    )


def regrets(
    problem: RoutingProblem,
    solver: Solver,
    *,
    limit: SolveLimit | None = None,
    radius: float = RADIUS,
    plan: Plan | None = None,
) -> tuple[Regret, ...]:
    """Return the regrets of all possible next visits, starting with the best visit.

    The exact planner evaluates all visits at once. It uses the full table for up to 18 objects, and otherwise
    one pass over all tours that are at most `radius` longer than the best tour. Regrets above the radius are
    lower bounds, marked as `capped`. If the pass is too large, the radius is halved, down to 0.1 m. The
    remaining task is solved separately after each visit if the pass is still too large, if the best tour is
    not proven optimal, or if the planner or the capacity does not allow a pass.

    Args:
        problem: Routing problem of the remaining task.
        solver: Planner. With the exact one, regrets that are `proven` and not `capped` are exact.
        limit: Limit for each problem that the planner solves.
        radius: Largest regret that is computed exactly, in metres.
        plan: Plan for this problem, or None. If the plan is proven optimal, the search for one is skipped.

    Raises:
        ProblemError: The radius is negative.
    """
    if not radius >= 0:
        raise ProblemError(f"the radius of regrets must be at least 0 m, got {radius}")
    costs = TaskTable(solver).costs(problem) if isinstance(solver, ExactSolver) else None
    if costs is not None:
        return _ranked(problem, *costs)
    return _beyond_table(problem, solver, limit, radius, plan)


def one_by_one(
    problem: RoutingProblem, solver: Solver, *, limit: SolveLimit | None = None
) -> tuple[Regret, ...]:
    """Compute regrets with any solver by solving the remaining task after each possible next visit."""
    found = []
    for visit in possible_next(problem):
        plan = solver.solve(after(problem, visit), limit=limit)
        cost = float(problem.distances[problem.start, problem.location(visit)]) + plan.cost
        found.append((cost, visit, plan.status is Status.OPTIMAL))
    least = min((cost for cost, _, _ in found), default=0.0)
    proven = all(proven for _, _, proven in found)  # a single unproven cost makes all regrets unproven
    found.sort(key=lambda entry: entry[0])
    return tuple(Regret(visit, cost, cost - least, proven) for cost, visit, _ in found)


def _ranked(
    problem: RoutingProblem,
    costs: Costs,
    unit: float,
    longest: float = math.inf,
    least: Costs | None = None,
) -> tuple[Regret, ...]:
    found = []
    for visit in possible_next(problem):
        cost, capped = costs[visit], costs[visit] > longest
        found.append((max(longest, least[visit]) if capped and least else cost, capped, visit))
    found.sort(key=lambda entry: entry[:2])
    lowest = found[0][0] if found else 0
    return tuple(
        Regret(visit, cost * unit, (cost - lowest) * unit, True, capped) for cost, capped, visit in found
    )


def _beyond_table(
    problem: RoutingProblem, solver: Solver, limit: SolveLimit | None, radius: float, plan: Plan | None
) -> tuple[Regret, ...]:
    found = None
    if isinstance(solver, ExactSolver) and solver.applies(problem):
        found = _around_best(problem, solver, limit, radius, plan)
    return found if found is not None else one_by_one(problem, solver, limit=limit)


def _around_best(
    problem: RoutingProblem, solver: ExactSolver, limit: SolveLimit | None, radius: float, plan: Plan | None
) -> tuple[Regret, ...] | None:
    """Compute all regrets in one pass over the tours that are at most `radius` longer than a proven plan.

    Return None if the pass is too large or there is no proven plan.
    """
    metric, unit = problem.integers.metric, problem.integers.unit
    if plan is None or plan.status is not Status.OPTIMAL:
        plan = solver.solve(problem, limit=limit)
    if plan.status is not Status.OPTIMAL:
        return None
    best = int(tour_length(problem, plan.visits, metric))
    deadline = Deadline(None, limit.stop if limit else None)
    instance, n = make_instance(problem, metric), len(problem.shipments)
    start = NOTHING_KNOWN.updated(problem, plan).numbered(problem.names[:n], instance.unit)
    bound = first_bound(instance, best) if start is None else warm_bound(instance, start, MAX_ROWS)
    bound = grown(bound, best, MAX_ROWS, deadline)
    table = bound.table
    relaxed = costs_in(bound.instance, table, len(table.bin) - 1, problem.names[:n], problem.names[n:])
    least = {visit: cost - bound.prices for visit, cost in relaxed.items()}
    dearest = (2 * n + len(problem.onboard)) * int(metric.max())  # upper bound on tour lengths
    while True:
        longest = best + math.floor(min(radius / unit, dearest))
        costs = costs_by_pass(bound, list(possible_next(problem)), longest, MAX_STATES, deadline)
        if costs is not None:
            return _ranked(problem, costs, unit, longest, least)
        radius /= 2
        if radius < MIN_RADIUS or deadline.over():
            return None


def _is_best(plan: Plan, problem: RoutingProblem) -> bool:
    visits = {problem.place(k) for k in range(len(problem.names))}
    visits |= {problem.pick(k) for k in range(len(problem.shipments))}
    if plan.status is not Status.OPTIMAL or set(plan.visits) != visits:
        return False
    return abs(tour_length(problem, plan.visits) - plan.cost) <= SAME
