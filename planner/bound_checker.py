"""Lower bounds of tours derived anew from a certificate, in plain numpy and floats, without the solvers' code."""

import functools

import numpy as np
from numpy.typing import NDArray

from planner.certificate import Certificate, Proof
from planner.errors import ProblemError
from planner.plan import Plan
from planner.problem import RoutingProblem
from planner.relaxation_checker import closed, relax

FEW = 7  # objects whose tours are all tried
MAX_ROWS = 1 << 16  # of a table that is computed anew: some 2 s

Matrix = NDArray[np.float64]


def proven_bound(problem: RoutingProblem, plan: Plan) -> float:
    """A lower bound of all tours, m, derived from the certificate alone.

    Up to seven objects every order of visits is tried, whatever the certificate. Beyond, a spanning tree is grown
    anew, and a table (full, or relaxed with the certificate's groups and prices) is filled anew from the recurrences
    up to 2^16 rows. A search is not repeated.

    Returns:
        The bound; 0 where nothing could be derived.

    Raises:
        ProblemError: The certificate, or the lower bound of the plan, claims more than that proves.
    """
    rounding = allowance(problem, plan)
    certificate = plan.certificate
    if len(problem.shipments) + len(problem.onboard) <= FEW:
        optimum = _optimum(problem)
        _refuse(plan.lower_bound, optimum, rounding, "lower bound")
        return optimum
    if certificate is None:
        return 0.0
    derived = 0.0
    if certificate.proof is Proof.SPANNING_TREE:
        derived = _spanning_tree(problem, closed(problem))
    elif certificate.proof in (Proof.FULL_TABLE, Proof.RELAXATION) and problem.capacity == 2:
        group, prices = claim(problem, certificate)
        if np.prod(np.bincount(group) + 1.0) > MAX_ROWS:
            return 0.0
        derived = relax(problem, group, prices).root
    else:
        return 0.0
    _refuse(certificate.root * certificate.unit, derived, rounding, "certificate's root")
    if certificate.proof is not Proof.RELAXATION:  # the only one with a search behind it
        _refuse(plan.lower_bound, derived, rounding, "lower bound")
    return derived


def allowance(problem: RoutingProblem, plan: Plan) -> float:
    """By how much what a plan claims may exceed the truth, m: rounding to the problem's resolution counts."""
    return problem.tolerance(plan.cost) + 2 * (problem.resolution or 0.0)


def _refuse(claimed: float, derived: float, rounding: float, what: str) -> None:
    if claimed > derived + rounding:
        raise ProblemError(f"the {what} claims {claimed} m, but its proof yields only {derived} m")


def claim(problem: RoutingProblem, certificate: Certificate) -> tuple[NDArray[np.int64], Matrix]:
    """Group of each shipment in a table, (n,), and the price of picking it, m, (n,).

    Raises:
        ProblemError: The certificate is not about these shipments.
    """
    n = len(problem.shipments)
    if certificate.proof is Proof.FULL_TABLE:
        return np.arange(n), np.zeros(n)
    groups, prices = certificate.groups, certificate.multipliers
    members = sorted(k for group in groups for k in group)
    if members != list(range(n)) or not all(groups) or len(prices) != n:
        raise ProblemError(
            f"a certificate with the groups {groups} and {len(prices)} prices does not fit {n} shipments"
        )
    group = np.empty(n, np.int64)
    for g, together in enumerate(groups):
        group[list(together)] = g
    return group, certificate.unit * np.array(prices, dtype=np.float64)


def _optimum(problem: RoutingProblem) -> float:
    """The shortest tour, by trying every visit next from every state."""
    d = problem.distances.tolist()

    @functools.cache
    def to_go(here: int, loose: frozenset[int], carried: tuple[int, ...]) -> float:
        lengths = [
            d[here][j] + to_go(j, loose, carried[:k] + carried[k + 1 :]) for k, j in enumerate(carried)
        ]
        if len(carried) < problem.capacity:
            for k in loose:
                shipment = problem.shipments[k]
                held = tuple(sorted((*carried, shipment.delivery)))
                lengths.append(d[here][shipment.pickup] + to_go(shipment.pickup, loose - {k}, held))
        return min(lengths, default=0.0)

    everything = frozenset(range(len(problem.shipments)))
    return to_go(problem.start, everything, tuple(sorted(problem.onboard)))


def _spanning_tree(problem: RoutingProblem, direct: Matrix) -> float:
    """Total length of a minimum spanning tree of all locations of the tour (Prim)."""
    places = {problem.start, *problem.onboard}
    places |= {j for s in problem.shipments for j in (s.pickup, s.delivery)}
    apart = {j: direct[problem.start, j] for j in places - {problem.start}}
    total = 0.0
    while apart:
        nearest = min(apart, key=apart.__getitem__)
        total += float(apart.pop(nearest))
        apart = {j: min(length, direct[nearest, j]) for j, length in apart.items()}
    return total
