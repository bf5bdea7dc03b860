"""The greedy planner, which serves as a baseline and provides a first plan for other planners."""

import time
from collections.abc import Iterator
from dataclasses import dataclass

from planner.plan import Certificate, Plan, Proof, Visit
from planner.problem import RoutingProblem, make_plan, possible_next, spanning_bound, tour_length
from planner.solvers import SolveLimit


@dataclass(frozen=True)
class GreedySolver:
    """A planner that always chooses the nearest possible visit."""

    name: str = "greedy"

    def solve(self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None) -> Plan:
        """Solve a problem within milliseconds. The seed and the limit have no effect."""
        del seed, limit
        return _plan(problem, spanning_bound(problem))

    def improve(
        self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None
    ) -> Iterator[Plan]:
        yield self.solve(problem, seed=seed, limit=limit)


def first_plan(problem: RoutingProblem) -> Plan:
    """Return the greedy tour with a lower bound of 0, which is the fastest plan to compute."""
    return _plan(problem, 0)


def _plan(problem: RoutingProblem, bound: int) -> Plan:
    started, integers = time.perf_counter(), problem.integers
    certificate = Certificate(Proof.SPANNING_TREE, integers.unit, bound)
    visits = nearest_first(problem)
    return make_plan(
        problem, visits, tour_length(problem, visits, integers.legs), bound, started, certificate
    )


def nearest_first(problem: RoutingProblem) -> list[Visit]:
    """Return a feasible tour that always continues with the nearest possible visit."""
    visits: list[Visit] = []
    here = problem.start
    while options := list(possible_next(problem, visits)):
        visits.append(min(options, key=lambda visit: problem.distances[here, problem.location(visit)]))
        here = problem.location(visits[-1])
    return visits
