"""Bound the remaining tours of successive task states, and keep the bounds from one visit to the next."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from planner.errors import ProblemError
from planner.exact.solver import ExactSolver
from planner.exact.task_search import TaskSearch
from planner.plan import Plan, Status, Visit, VisitKind
from planner.problem import RoutingProblem, possible_next, tour_length
from planner.route import XY, TaskState
from planner.solvers import SolveLimit

SAME = 1e-6  # difference up to which two distances or tour lengths count as equal, in metres


@dataclass(frozen=True, eq=False)
class _Kept:
    """A plan for the problem after a visit. The person is assumed to be exactly at the place of the visit."""

    problem: RoutingProblem
    plan: Plan
    place: XY


class TourBounds:
    """A source of plans, with lower bounds, for the states before and after a visit.

    The plan after a visit is kept for the state before the next visit. As the person makes visits from a
    distance, the lower bound decreases by the distance to the assumed place.

    Args:
        solver: Exact planner.
        search: Search whose budget all plans share.
        walk: Function that returns the length in metres of the shortest walk between two positions.
    """

    def __init__(self, solver: ExactSolver, search: TaskSearch, walk: Callable[[XY, XY], float]) -> None:
        self._solver, self._search, self._walk = solver, search, walk
        self._kept: dict[Visit, _Kept] = {}  # plans after visits of the last state
        self._last: tuple[RoutingProblem, Plan] | None = None  # the last state's problem, and the plan for it

    def before(
        self, state: TaskState, problem: RoutingProblem, plan: Plan | None, limit: SolveLimit | None
    ) -> Plan:
        """Return a plan for a state. It is `plan` itself if `plan` was made for this state."""
        if self._last is not None and same_problem(self._last[0], problem):
            return self._last[1]
        kept = next((k for k in self._kept.values() if _same_task(k.problem, problem)), None)
        self._kept = {}
        if plan is not None and is_for(plan, problem):
            self._search.learn(problem, plan)
            found = plan
        elif kept is not None and same_problem(kept.problem, problem) and kept.plan.status is Status.OPTIMAL:
            found = kept.plan
        else:
            found = self._solve(problem, limit)
        if kept is not None:
            found = _combined(problem, found, kept.plan, self._walk(state.position, kept.place))
        self._last = problem, found
        return found

    def after(
        self, state: TaskState, problem: RoutingProblem, before: Plan, visit: Visit, limit: SolveLimit | None
    ) -> Plan:
        """Return a plan for the state after a visit. The plan `before` contains it if it starts with the visit."""
        rest = after(problem, visit)
        if before.visits[0] == visit:
            found = _rest(problem, before)
        elif visit in self._kept and same_problem(self._kept[visit].problem, rest):
            found = self._kept[visit].plan
        else:
            found = self._solve(rest, limit)
        self._kept[visit] = _Kept(rest, found, place_of(state, visit))
        return found

    def follow(self, state: TaskState, problem: RoutingProblem, visit: Visit, plan: Plan) -> None:
        """Record a visit that a proven plan suggested. By the principle of optimality, its rest is proven, too."""
        if is_for(plan, problem):
            known: tuple[RoutingProblem, Plan] | None = problem, plan
        else:
            known = next(
                ((k.problem, k.plan) for k in self._kept.values() if _same_task(k.problem, problem)), None
            )
        self._kept = {}
        if known is not None and known[1].visits[:1] == (visit,):
            rest = after(known[0], visit)
            self._kept[visit] = _Kept(rest, _rest(*known), place_of(state, visit))

    def _solve(self, problem: RoutingProblem, limit: SolveLimit | None) -> Plan:
        if self._solver.applies(problem):
            return self._search.plan(problem, limit=limit)
        return self._solver.solve(problem, limit=limit)


def place_of(state: TaskState, visit: Visit) -> XY:
    """Return the position of the object or of its delivery."""
    return state.loose[visit.object] if visit.kind is VisitKind.PICK else state.deliveries[visit.object]


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


def is_for(plan: Plan, problem: RoutingProblem) -> bool:
    """Return True if a plan was made for a problem."""
    if set(plan.visits) != set(problem.visits):
        return False
    return abs(tour_length(problem, plan.visits) - plan.cost) <= SAME


def same_problem(one: RoutingProblem, other: RoutingProblem) -> bool:
    """Return True if two problems have the same objects, the same places and the same start."""
    if not _same_task(one, other):
        return False
    first, second = (each.distances[each.start, each.stops(one.visits)[1:]] for each in (one, other))
    return np.allclose(first, second, rtol=0.0, atol=SAME)


def _same_task(one: RoutingProblem, other: RoutingProblem) -> bool:
    """Return True if two problems differ at most in their start."""
    if set(one.visits) != set(other.visits) or one.capacity != other.capacity:
        return False
    here, there = (problem.stops(one.visits)[1:] for problem in (one, other))
    first, second = one.distances[np.ix_(here, here)], other.distances[np.ix_(there, there)]
    return np.allclose(first, second, rtol=0.0, atol=SAME)


def _rest(problem: RoutingProblem, plan: Plan) -> Plan:
    leg = float(problem.distances[problem.start, problem.location(plan.visits[0])])
    cost, lower = max(0.0, plan.cost - leg), max(0.0, plan.lower_bound - leg)
    return replace(plan, visits=plan.visits[1:], cost=cost, lower_bound=min(cost, lower), certificate=None)


def _combined(problem: RoutingProblem, found: Plan, kept: Plan, gap: float) -> Plan:
    """Return the shorter plan with the higher bound. `kept` starts `gap` metres away from the problem's start."""
    if found.status is Status.OPTIMAL:
        return found
    cost = tour_length(problem, kept.visits)
    if cost < found.cost:
        found = replace(found, visits=kept.visits, cost=cost, certificate=None)
    return replace(found, lower_bound=min(found.cost, max(found.lower_bound, kept.lower_bound - gap)))
