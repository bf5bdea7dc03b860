"""The nearest possible visit first: a baseline, and a first answer before any other planner has one."""

import time
from collections.abc import Iterator
from dataclasses import dataclass

from planner.certificate import Certificate, Proof
from planner.plan import Plan, Visit
from planner.problem import RoutingProblem
from planner.solvers import SolveLimit
from planner.tour import make_plan, possible_next, spanning_bound


@dataclass(frozen=True)
class GreedySolver:
    """Goes to the nearest possible visit, the first of equals."""

    name: str = "greedy"

    def solve(self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None) -> Plan:
        """Plan by nearest visit first, in milliseconds; seed and limit do not matter."""
        del seed, limit
        return _plan(problem, spanning_bound(problem))

    def improve(
        self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None
    ) -> Iterator[Plan]:
        """Yield the one plan that there is."""
        yield self.solve(problem, seed=seed, limit=limit)


def first_plan(problem: RoutingProblem) -> Plan:
    """The nearest-first tour without any bound, which no planner could give sooner."""
    return _plan(problem, 0)


def _plan(problem: RoutingProblem, bound: int) -> Plan:
    started, integers = time.perf_counter(), problem.integers
    certificate = Certificate(Proof.SPANNING_TREE, integers.unit, bound)
    return make_plan(problem, integers.legs, nearest_first(problem), bound, started, certificate)


def nearest_first(problem: RoutingProblem) -> list[Visit]:
    """A feasible tour that always goes to the nearest possible visit."""
    visits: list[Visit] = []
    here = problem.start
    while options := list(possible_next(problem, visits)):
        visits.append(min(options, key=lambda visit: problem.distances[here, problem.location(visit)]))
        here = problem.location(visits[-1])
    return visits
