"""What each possible next visit costs compared with the best one."""

import math
from dataclasses import dataclass, replace

from planner.errors import ProblemError
from planner.exact.deadline import Deadline
from planner.exact.instance import Instance, make_instance
from planner.exact.multipliers import Bound, first_bound, grown, warm_bound
from planner.exact.solver import ExactSolver
from planner.exact.table_regret import Costs, costs_by_pass, costs_in
from planner.exact.task_table import TaskTable
from planner.exact.warm_start import NOTHING_KNOWN
from planner.plan import Plan, Status, Visit, VisitKind
from planner.problem import RoutingProblem
from planner.solver import SolveLimit, Solver
from planner.tour import possible_next, tour_length

RADIUS = 1.0  # m
MAX_ROWS = 1 << 14  # of the table of the bound of the pass
MAX_STATES = 3_000_000  # of the pass: some 200 MB
MIN_RADIUS = 0.1  # m; below this a pass is not tried again


@dataclass(frozen=True)
class Regret:
    """A possible next visit.

    Attributes:
        visit: What is done next.
        cost: Length of the rest of the task if it is done next and the rest is as short as possible, m.
        regret: By how much that exceeds the least such cost, m.
        proven: Whether the numbers are exact; where `capped`, whether they are true lower bounds.
        capped: Whether cost and regret are only known to be at least this.
    """

    visit: Visit
    cost: float
    regret: float
    proven: bool
    capped: bool = False


def after(problem: RoutingProblem, visit: Visit) -> RoutingProblem:
    """What is left to do once a visit has been made; shipments and onboard keep their order.

    Raises:
        ProblemError: Capacity or precedence do not allow the visit now.
    """
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
    at least the radius, and say so (`capped`). Where the pass grows too large, the radius is halved, down to 0.1 m;
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
    found = None
    if isinstance(solver, ExactSolver):
        costs = TaskTable(solver).costs(problem)
        if costs is not None:
            return ranked(problem, *costs)
        found = _around_best(problem, solver, limit, radius, plan)
    return found if found is not None else one_by_one(problem, solver, limit=limit)


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


def ranked(
    problem: RoutingProblem,
    costs: Costs,
    unit: float,
    longest: int | None = None,
    least: Costs | None = None,
) -> tuple[Regret, ...]:
    """Regrets from integer costs, the best visit first.

    Args:
        problem: What is left to do.
        costs: Length of the rest of the task by next visit, units.
        unit: m per unit.
        longest: Costs above this are not known but for being above it; None where all are known.
        least: Lower bounds of the costs, for those.
    """
    found = []
    for visit in possible_next(problem):
        cost, capped = costs[visit], longest is not None and costs[visit] > longest
        if longest is not None and least is not None and capped:
            cost = max(longest, least[visit])
        found.append((cost, capped, visit))
    found.sort(key=lambda entry: entry[:2])
    lowest = found[0][0] if found else 0
    return tuple(
        Regret(visit, cost * unit, (cost - lowest) * unit, True, capped) for cost, capped, visit in found
    )


def _around_best(
    problem: RoutingProblem, solver: ExactSolver, limit: SolveLimit | None, radius: float, plan: Plan | None
) -> tuple[Regret, ...] | None:
    """Regrets within the radius of a proven plan, from one pass; None if that is too much or there is no such plan."""
    if not solver.applies(problem):
        return None
    metric, unit = problem.integers.metric, problem.integers.unit
    if plan is None or plan.status is not Status.OPTIMAL:
        plan = solver.solve(problem, limit=limit)
    if plan.status is not Status.OPTIMAL:
        return None
    best = int(tour_length(problem, plan.visits, metric))
    deadline = Deadline(None, limit.stop if limit else None)
    bound = _bound(make_instance(problem, metric), problem, plan, best, deadline)
    table, n = bound.table, len(problem.shipments)
    relaxed = costs_in(bound.instance, table, len(table.bin) - 1, problem.names[:n], problem.names[n:])
    least = {visit: cost - bound.prices for visit, cost in relaxed.items()}
    while True:
        longest = best + math.floor(radius / unit)
        costs = costs_by_pass(bound, list(possible_next(problem)), longest, MAX_STATES, deadline)
        if costs is not None:
            return ranked(problem, costs, unit, longest, least)
        radius /= 2
        if radius < MIN_RADIUS or deadline.over():
            return None


def _bound(instance: Instance, problem: RoutingProblem, plan: Plan, best: int, deadline: Deadline) -> Bound:
    """A tight bound, from the plan's multipliers."""
    start = NOTHING_KNOWN.updated(problem, plan).numbered(
        problem.names[: len(problem.shipments)], instance.unit
    )
    bound = first_bound(instance, best) if start is None else warm_bound(instance, start, MAX_ROWS)
    return grown(bound, best, MAX_ROWS, deadline)
