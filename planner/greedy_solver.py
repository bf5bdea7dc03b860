"""The nearest possible visit first: a baseline, and the first answer where no other is quick enough."""

import time
from collections.abc import Iterator
from dataclasses import dataclass

from planner.certificate import Certificate, Proof
from planner.plan import Plan, Visit
from planner.problem import RoutingProblem
from planner.solver import SolveLimit
from planner.tour import make_plan, possible_next, spanning_bound, with_bound


@dataclass(frozen=True)
class GreedySolver:
    """Goes to the nearest possible visit, the first of equals."""

    name: str = "greedy"

    def solve(self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None) -> Plan:
        """Plan by nearest visit first; seed and limit do not matter.

        Args:
            problem: What is left to do.
            seed: Unused: nothing is random.
            limit: Unused: it takes milliseconds.
        """
        del seed, limit
        started = time.perf_counter()
        visits, bound, integers = nearest_first(problem), spanning_bound(problem), problem.integers
        certificate = Certificate(Proof.SPANNING_TREE, integers.unit, bound)
        return make_plan(problem, integers.legs, visits, bound, started, certificate)

    def improve(
        self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None
    ) -> Iterator[Plan]:
        """Yield the one plan that there is."""
        yield self.solve(problem, seed=seed, limit=limit)


def first_plan(problem: RoutingProblem) -> Plan:
    """The nearest-first tour without any bound, which no planner could give sooner."""
    certificate = Certificate(Proof.SPANNING_TREE, problem.integers.unit, 0)
    return with_bound(problem, nearest_first(problem), 0.0, time.perf_counter(), certificate)


def nearest_first(problem: RoutingProblem) -> list[Visit]:
    """A feasible tour that always goes to the nearest possible visit."""
    visits: list[Visit] = []
    here = problem.start
    while options := list(possible_next(problem, visits)):
        visits.append(min(options, key=lambda visit: problem.distances[here, problem.location(visit)]))
        here = problem.location(visits[-1])
    return visits
