"""What solvers share: integer metrics, possible next visits, and plans from an order of visits."""

import time
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.certificate import Certificate
from planner.plan import Plan, Status, Visit, VisitKind
from planner.problem import RoutingProblem

UNIT = 1e-4  # m per integer unit of distance: 0.1 mm


def integer_distances(distances: NDArray[np.float64]) -> NDArray[np.int64]:
    """Distances in units of 0.1 mm, symmetric, (k, k)."""
    rounded = np.rint(distances / UNIT)
    return np.minimum(rounded, rounded.T).astype(np.int64)


def integer_metric(distances: NDArray[np.float64]) -> NDArray[np.int64]:
    """Distances in units of 0.1 mm, closed to a metric, (k, k).

    Rounding can break the triangle inequality by a unit, and solvers rely on it: closing restores it.
    """
    rounded = integer_distances(distances)
    for k in range(len(rounded)):  # Floyd-Warshall; scipy's reads a distance of 0 as "no edge"
        np.minimum(rounded, rounded[:, k, None] + rounded[None, k, :], out=rounded)
    return rounded


def is_metric(distances: NDArray[np.float64], metric: NDArray[np.int64]) -> bool:
    """Whether distances, m, (k, k), keep the triangle inequality, to rounding; `metric` is their closure, (k, k)."""
    return bool((integer_distances(distances) - metric).max(initial=0) <= 2 * len(metric))


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
    """Length of an open tour.

    Args:
        problem: The problem.
        visits: The tour.
        distances: In place of the problem's own, (k, k); the length is in their unit, exact for integers below 2^53.
    """
    stops = problem.stops(visits)
    return float((problem.distances if distances is None else distances)[stops[:-1], stops[1:]].sum())


def spanning_bound(problem: RoutingProblem, metric: NDArray[np.int64]) -> int:
    """Lower bound of a tour: as it connects all its locations, the length of their minimum spanning tree, units.

    Args:
        problem: What is left to do.
        metric: Its integer metric, units, (k, k).
    """
    from scipy.sparse.csgraph import minimum_spanning_tree  # takes longer to load than most tours to plan

    used = sorted(
        {problem.start, *problem.onboard}
        | {s.pickup for s in problem.shipments}
        | {s.delivery for s in problem.shipments}
    )
    if len(used) == 1:
        return 0
    # A stored 0 would mean "no edge". Every tree has one edge less than nodes: undo the 1 added to each.
    tree = minimum_spanning_tree(metric[np.ix_(used, used)] + 1)
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

    Args:
        problem: What was solved.
        metric: Its integer metric, units of 0.1 mm, (k, k).
        visits: The tour.
        bound: Lower bound in the integer metric, units of 0.1 mm.
        started: `time.perf_counter()` when solving began.
        certificate: What proves the bound.

    Returns:
        OPTIMAL if the tour meets the bound in the integer metric and is as long in the given distances (to
        rounding). The latter fails only for distances that were no metric.
    """
    cost = tour_length(problem, visits)
    rounding = 2 * UNIT * len(visits)
    optimal = tour_length(problem, visits, metric) <= bound and cost <= bound * UNIT + rounding
    lower = cost if optimal else max(0.0, min(cost, bound * UNIT - rounding))
    status = Status.OPTIMAL if optimal else Status.FEASIBLE
    return Plan(tuple(visits), cost, lower, status, time.perf_counter() - started, certificate)
