"""What solvers share: possible next visits, lengths of tours, and plans from an order of visits."""

import time
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.certificate import Certificate
from planner.plan import Plan, Status, Visit, VisitKind
from planner.problem import RoutingProblem


def possible_next(problem: RoutingProblem, visits: Sequence[Visit] = ()) -> Iterator[Visit]:
    """Visits that capacity and precedence allow after the given ones."""
    done, n = set(visits), len(problem.shipments)
    load = len(problem.onboard)
    for visit in visits:
        load += 1 if visit.kind is VisitKind.PICK else -1
    for k in range(n, len(problem.names)):
        if problem.place(k) not in done:
            yield problem.place(k)
    for k in range(n):
        if problem.pick(k) not in done:
            if load < problem.capacity:
                yield problem.pick(k)
        elif problem.place(k) not in done:
            yield problem.place(k)


def tour_length(
    problem: RoutingProblem, visits: Iterable[Visit], distances: NDArray[Any] | None = None
) -> float:
    """Length of an open tour; `distances`, (k, k), replace the problem's own, and are exact for integers below 2^53."""
    stops = problem.stops(visits)
    return float((problem.distances if distances is None else distances)[stops[:-1], stops[1:]].sum())


def spanning_bound(problem: RoutingProblem) -> int:
    """Lower bound of a tour, units: as it connects all its locations, the length of their minimum spanning tree."""
    from scipy.sparse.csgraph import minimum_spanning_tree  # takes longer to load than most tours to plan

    used = problem.used
    if len(used) == 1:
        return 0
    # A stored 0 would mean "no edge". Every tree has one edge less than nodes: undo the 1 added to each.
    tree = minimum_spanning_tree(problem.integers.legs[np.ix_(used, used)] + 1)
    return int(tree.sum()) - (len(used) - 1)


def make_plan(
    problem: RoutingProblem,
    metric: NDArray[np.int64],
    visits: Sequence[Visit],
    bound: int,
    started: float,
    certificate: Certificate,
) -> Plan:
    """A plan with a lower bound that also holds for the given distances, which are not whole units.

    `metric` are the integer distances that the problem was solved in, (k, k), in whose units no tour is shorter than
    `bound`; `started` is `time.perf_counter()` when solving began. OPTIMAL if the tour meets the bound in the integer
    distances, and in the given ones to the problem's tolerance; the latter fails only for distances that are no metric.
    """
    integers, cost = problem.integers, tour_length(problem, visits)
    lower = certificate.unit * (bound - integers.rounding * len(visits))  # each leg may have been rounded up
    met = tour_length(problem, visits, metric) <= bound + integers.tie
    rounding = (problem.resolution or 0.0) * len(visits) / 2
    optimal = met and cost - lower <= problem.tolerance(cost) + rounding
    status = Status.OPTIMAL if optimal else Status.FEASIBLE
    lower = cost if optimal else max(0.0, min(cost, lower))
    return Plan(tuple(visits), cost, lower, status, time.perf_counter() - started, certificate)
