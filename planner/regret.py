"""What each possible next visit costs compared with the best one."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.certificate import Proof
from planner.errors import ProblemError
from planner.exact.deadline import Deadline
from planner.exact.instance import Instance, make_instance
from planner.exact.multipliers import Bound, first_bound, grown
from planner.exact.solver import ExactSolver
from planner.exact.table_regret import Costs, costs_by_pass, costs_by_table, costs_in
from planner.exact.warm import warm_bound
from planner.plan import Plan, Status, Visit, VisitKind
from planner.problem import RoutingProblem
from planner.solver import SolveLimit, Solver
from planner.tour import UNIT, integer_metric, possible_next

RADIUS = 1.0  # m
MOST_ROWS = 1 << 14  # of the table of the bound of the pass
MOST_STATES = 3_000_000  # of the pass: some 200 MB
SMALLEST_RADIUS = 0.1  # m; below this a pass is not tried again


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
    if visit not in possible_next(problem, ()):
        raise ProblemError(f"{visit} is not possible now; choose one of possible_next")
    shipments, onboard = list(problem.shipments), list(problem.onboard)
    if visit.kind is VisitKind.PICK and visit.shipment is not None:
        onboard.append(shipments.pop(visit.shipment).delivery)
    elif visit.onboard is not None:
        onboard.pop(visit.onboard)
    return RoutingProblem(
        problem.distances, visit.location, tuple(shipments), tuple(onboard), problem.capacity
    )


def regrets(
    problem: RoutingProblem,
    solver: Solver,
    *,
    seed: int = 0,
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
        seed: Handed to the solver.
        limit: Handed to the solver, for each problem that it solves.
        radius: Regrets up to here are wanted exactly, m.
        plan: A plan of this problem, if there is one: if it is proven it need not be found again.

    Raises:
        ProblemError: The radius is negative.
    """
    if not radius >= 0:
        raise ProblemError(f"the radius of regrets must be at least 0 m, got {radius}")
    found = _exactly(problem, solver, seed, limit, radius, plan) if isinstance(solver, ExactSolver) else None
    return found if found is not None else one_by_one(problem, solver, seed=seed, limit=limit)


def one_by_one(
    problem: RoutingProblem, solver: Solver, *, seed: int = 0, limit: SolveLimit | None = None
) -> tuple[Regret, ...]:
    """Solve the rest of the task after each possible next visit; with any solver, for any problem."""
    found = []
    for visit in possible_next(problem, ()):
        plan = solver.solve(after(problem, visit), seed=seed, limit=limit)
        cost = float(problem.distances[problem.start, visit.location]) + plan.cost
        found.append((cost, visit, plan.status is Status.OPTIMAL))
    least = min((cost for cost, _, _ in found), default=0.0)
    proven = all(proven for _, _, proven in found)  # a regret is only as good as the least cost
    ranked = sorted(found, key=lambda entry: entry[0])
    return tuple(Regret(visit, cost, cost - least, proven) for cost, visit, _ in ranked)


def _exactly(
    problem: RoutingProblem,
    solver: ExactSolver,
    seed: int,
    limit: SolveLimit | None,
    radius: float,
    plan: Plan | None,
) -> tuple[Regret, ...] | None:
    metric = integer_metric(problem.distances)
    if not solver.applies(problem, metric):
        return None
    instance = make_instance(problem, metric)
    if solver.table_fits(instance):
        costs = costs_by_table(instance)
        return ranked(problem, costs, max(costs.values(), default=0), costs)
    if plan is None or plan.status is not Status.OPTIMAL:
        plan = solver.solve(problem, seed=seed, limit=limit)
    if plan.status is not Status.OPTIMAL:
        return None
    return _around(problem, instance, metric, plan, radius, limit)


def _around(
    problem: RoutingProblem,
    instance: Instance,
    metric: NDArray[np.int64],
    plan: Plan,
    radius: float,
    limit: SolveLimit | None,
) -> tuple[Regret, ...] | None:
    """Regrets within the radius of a proven plan, from one pass; None if that is too much."""
    order = [problem.start, *(v.location for v in plan.visits)]
    best = int(metric[order[:-1], order[1:]].sum())
    deadline = Deadline(None, limit.stop if limit else None)
    bound = _bound(instance, plan, best, deadline)
    relaxed = costs_in(bound.instance, bound.table)
    least = {k: cost - bound.prices for k, cost in relaxed.items()}
    while True:
        longest = best + math.floor(radius / UNIT)
        costs = costs_by_pass(bound, longest, MOST_STATES, deadline)
        if costs is not None:
            return ranked(problem, costs, longest, least)
        radius /= 2
        if radius < SMALLEST_RADIUS or deadline.over():
            return None


def _bound(instance: Instance, plan: Plan, best: int, deadline: Deadline) -> Bound:
    """A tight bound, from the plan's prices."""
    certificate = plan.certificate
    if certificate is not None and certificate.proof is Proof.RELAXATION:
        bound = warm_bound(instance, certificate, MOST_ROWS)
    else:
        bound = first_bound(instance, best)
    return grown(bound, best, MOST_ROWS, deadline)


def ranked(problem: RoutingProblem, costs: Costs, longest: int, least: Costs) -> tuple[Regret, ...]:
    """Regrets from integer costs, the best visit first; those above `longest` are unknown but for that and `least`."""
    found = []
    for visit in possible_next(problem, ()):
        action = visit.shipment if visit.shipment is not None else -1 - (visit.onboard or 0)
        capped = costs[action] > longest
        found.append((max(longest, least[action]) if capped else costs[action], capped, visit))
    lowest = min((cost for cost, _, _ in found), default=0)
    ranked = sorted(found, key=lambda entry: entry[:2])
    return tuple(
        Regret(visit, cost * UNIT, (cost - lowest) * UNIT, True, capped) for cost, capped, visit in ranked
    )
