"""What each possible next visit costs compared with the best one."""

import math
from dataclasses import dataclass, replace

from planner.errors import ProblemError
from planner.exact.deadline import Deadline
from planner.exact.instance import make_instance
from planner.exact.multipliers import first_bound, grown, warm_bound
from planner.exact.solver import ExactSolver
from planner.exact.table_regret import Costs, costs_by_pass, costs_in
from planner.exact.task_table import TaskTable
from planner.exact.warm_start import NOTHING_KNOWN
from planner.geodesics import Geodesics
from planner.plan import Plan, Status, Visit, VisitKind
from planner.problem import RoutingProblem
from planner.route import TaskState
from planner.solvers import SolveLimit, Solver
from planner.task_problems import TaskProblems
from planner.tour import possible_next, tour_length

RADIUS = 1.0  # m
MIN_RADIUS = 0.1  # m; below this a pass is not tried again
MAX_ROWS = 1 << 14  # of the table of the bound of the pass
MAX_STATES = 3_000_000  # of the pass: some 200 MB
SAME = 1e-6  # m


@dataclass(frozen=True)
class Regret:
    """A possible next visit."""

    visit: Visit  # the visit
    cost: float  # length of the rest of the task if it is done next and the rest is as short as possible, m
    regret: float  # by how much that exceeds the least such cost, m
    proven: bool  # whether the numbers are exact; where `capped`, whether they are true lower bounds
    capped: bool = False  # whether cost and regret are only known to be at least this


class RegretEvaluator:
    """Evaluates possible and actual visits of a task, always with the exact planner; results repeat bit for bit.

    `limit` is that of each search, beyond 18 objects left; None for the planner's own budget of work. `all` gives
    regrets up to `radius` exactly, m.
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
        """A new evaluator like this one, for use in a thread, with a limit of each search."""
        return RegretEvaluator(
            self._geodesics, solver=self._solver, capacity=self._capacity, limit=limit, radius=self._radius
        )

    def all(self, state: TaskState, plan: Plan | None = None) -> dict[Visit, Regret]:
        """The cost of each possible next visit compared with the best one, the best first.

        `plan` is that for this state or one before; if it is proven and of this state, no other is searched.
        `UnreachableError` names the objects that cannot be fetched or delivered.
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
        """By how much a visit makes the rest of the task longer than the best one does, m, however large.

        None where the visit is not possible or nothing is proven. Arguments and errors as in `all`.
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
        warm = NOTHING_KNOWN.updated(problem, before)  # halves the work
        *_, rest = self._solver.improve(after(problem, visit), limit=self._limit, warm=warm)
        if not before.status is rest.status is Status.OPTIMAL:
            return None
        leg = float(problem.distances[problem.start, problem.location(visit)])
        return max(0.0, leg + rest.cost - before.cost)


def same_state(one: TaskState, other: TaskState) -> bool:
    """Whether the person and all objects are at the same place in both states."""
    return one is other or (one.position, one.carried, one.loose) == (
        other.position,
        other.carried,
        other.loose,
    )


def after(problem: RoutingProblem, visit: Visit) -> RoutingProblem:
    """The rest of the task after a visit; shipments and onboard keep their order. `ProblemError` if impossible."""
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
    """What each possible next visit costs, the best visit first.

    The exact planner answers for all visits at once: from its full table where that fits (18 objects), else by one
    pass over all tours that are at most `radius` longer than the best. Beyond that radius, regrets are lower bounds,
    at least the radius, and `capped`. Where the pass grows too large, the radius is halved, down to 0.1 m;
    where even that is too much or the best tour was not proven, and for other capacities and solvers, the rest of
    the task is solved after each visit.

    Args:
        problem: What is left to do.
        solver: Plans the rest; with the exact one, regrets are exact where `proven` and not `capped`.
        limit: Handed to the solver, for each problem that it solves.
        radius: Regrets up to here are wanted exactly, m.
        plan: A plan of this problem, if there is one: if it is proven it need not be found again.

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
    """Solve the rest of the task after each possible next visit; with any solver, for any problem."""
    found = []
    for visit in possible_next(problem):
        plan = solver.solve(after(problem, visit), limit=limit)
        cost = float(problem.distances[problem.start, problem.location(visit)]) + plan.cost
        found.append((cost, visit, plan.status is Status.OPTIMAL))
    least = min((cost for cost, _, _ in found), default=0.0)
    proven = all(proven for _, _, proven in found)  # a regret is only as good as the least cost
    found.sort(key=lambda entry: entry[0])
    return tuple(Regret(visit, cost, cost - least, proven) for cost, visit, _ in found)


def _ranked(
    problem: RoutingProblem,
    costs: Costs,
    unit: float,
    longest: float = math.inf,
    least: Costs | None = None,
) -> tuple[Regret, ...]:
    """Regrets from costs in units of `unit` m, the best first; `least` bounds those that are above `longest`."""
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
    """Regrets within the radius of a proven plan, from one pass; None if that is too much or there is no such plan."""
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
    dearest = (2 * n + len(problem.onboard)) * int(metric.max())  # no tour is longer
    while True:
        longest = best + math.floor(min(radius / unit, dearest))
        costs = costs_by_pass(bound, list(possible_next(problem)), longest, MAX_STATES, deadline)
        if costs is not None:
            return _ranked(problem, costs, unit, longest, least)
        radius /= 2
        if radius < MIN_RADIUS or deadline.over():
            return None


def _is_best(plan: Plan, problem: RoutingProblem) -> bool:
    """Whether a plan is proven and of this problem, not of an earlier state of the task."""
    visits = {problem.place(k) for k in range(len(problem.names))}
    visits |= {problem.pick(k) for k in range(len(problem.shipments))}
    if plan.status is not Status.OPTIMAL or set(plan.visits) != visits:
        return False
    return abs(tour_length(problem, plan.visits) - plan.cost) <= SAME
