"""Lower bounds of tours derived anew from a certificate, in plain numpy and metres, without the solvers' code."""

import functools

import numpy as np
from numpy.typing import NDArray

from planner.certificate import Certificate, Proof
from planner.errors import ProblemError
from planner.plan import Plan
from planner.problem import RoutingProblem

UNIT = 1e-4  # m per unit of a certificate
FEW = 7  # objects whose tours are all tried
MOST_ROWS = 1 << 16  # of a table that is computed anew: some 2 s

Matrix = NDArray[np.float64]


def proven_bound(problem: RoutingProblem, plan: Plan) -> float:
    """A length that no tour falls short of, m, derived from the certificate's claim alone.

    Up to seven objects every order of visits is tried, whatever the certificate. Beyond, a spanning tree is grown
    anew, and a table (full, or relaxed with the certificate's subset and prices) is filled anew from the recurrences
    up to 2^16 rows. A search is not repeated.

    Returns:
        The bound; 0 where nothing could be derived.

    Raises:
        ProblemError: The certificate, or the lower bound of the plan, claims more than that proves.
    """
    visits = 2 * len(problem.shipments) + len(problem.onboard)
    rounding = 2 * UNIT * (visits + 1)
    certificate = plan.certificate
    if len(problem.shipments) + len(problem.onboard) <= FEW:
        optimum = _optimum(problem)
        _refuse(plan.lower_bound, optimum, rounding, "lower bound")
        return optimum
    if certificate is None:
        return 0.0
    closed = _closed(problem.distances)
    derived = 0.0
    if certificate.proof is Proof.SPANNING_TREE:
        derived = _spanning_tree(problem, closed)
    elif certificate.proof in (Proof.FULL_TABLE, Proof.RELAXATION) and problem.capacity == 2:
        exact, prices = _claim(problem, certificate)
        if (len(prices) - len(exact) + 1) << len(exact) > MOST_ROWS:
            return 0.0
        derived = _relaxed_optimum(problem, closed, exact, prices)
    else:
        return 0.0
    # The claim is about a metric of rounded lengths: a shift of at most half a unit a leg, and closing undoes more.
    _refuse(certificate.root * UNIT, derived, rounding, "certificate's root")
    if certificate.proof is not Proof.RELAXATION:  # the only one with a search behind it
        _refuse(plan.lower_bound, derived, rounding, "lower bound")
    return derived


def _refuse(claimed: float, derived: float, rounding: float, what: str) -> None:
    if claimed > derived + rounding:
        raise ProblemError(f"the {what} claims {claimed} m, but its proof yields only {derived} m")


def _claim(problem: RoutingProblem, certificate: Certificate) -> tuple[tuple[int, ...], Matrix]:
    """Which shipments a table keeps exactly, and the price of picking each, m."""
    n = len(problem.shipments)
    if certificate.proof is Proof.FULL_TABLE:
        return tuple(range(n)), np.zeros(n)
    exact = certificate.exact
    known = set(exact) <= set(range(n)) and len(set(exact)) == len(exact)
    if not known or len(certificate.multipliers) != n:
        raise ProblemError(
            f"a certificate that keeps {exact} exactly with {len(certificate.multipliers)} prices "
            f"does not fit {n} shipments"
        )
    return exact, UNIT * np.array(certificate.multipliers, dtype=np.float64)


def _closed(distances: Matrix) -> Matrix:
    """Shortest connections; no tour of the given distances is shorter than in these."""
    closed = np.minimum(distances, distances.T)
    for k in range(len(closed)):
        closed = np.minimum(closed, closed[:, k, None] + closed[None, k, :])
    return closed


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


def _spanning_tree(problem: RoutingProblem, closed: Matrix) -> float:
    """Total length of a minimum spanning tree of all locations of the tour (Prim)."""
    places = {problem.start, *problem.onboard}
    places |= {j for s in problem.shipments for j in (s.pickup, s.delivery)}
    apart = {j: closed[problem.start, j] for j in places - {problem.start}}
    total = 0.0
    while apart:
        nearest = min(apart, key=apart.__getitem__)
        total += float(apart.pop(nearest))
        apart = {j: min(length, closed[nearest, j]) for j, length in apart.items()}
    return total


def _relaxed_optimum(problem: RoutingProblem, d: Matrix, exact: tuple[int, ...], prices: Matrix) -> float:
    """Shortest relaxed tour less all prices, m.

    A state knows which objects of `exact` are left and how many others, so that those may be picked repeatedly,
    though not twice in a row. Every real tour is a relaxed one that pays each price once. What belongs where one is,
    is left there: in a metric that is never wrong. The states with `left` objects left, one row for each subset:

        V(b, c): at place b with one object for bin c in hand, V(c, c): at bin c with empty hands;
        E(b): at place b with empty hands; Y(i): at object i with only that. The last place is the start.
    """
    n, s = len(problem.shipments), len(exact)
    bins = sorted({x.delivery for x in problem.shipments} | set(problem.onboard))
    home = [bins.index(x.delivery) for x in problem.shipments]
    at = [x.pickup for x in problem.shipments]
    m, subsets = len(bins), np.arange(1 << s)
    size = np.array([int(k).bit_count() for k in subsets])
    to_bin, to_place = d[np.ix_(at, bins)], d[np.ix_(at, [*bins, problem.start])]
    between = d[np.ix_(at, at)] + np.where(np.eye(n, dtype=bool), np.inf, 0.0)
    leave = d[np.ix_([*bins, problem.start], bins)]
    V, Y = np.full((1 << s, m + 1, m), np.inf), np.full((1 << s, n), np.inf)
    V[0], Y[0], E = leave, to_bin[np.arange(n), home], np.zeros(m + 1)
    for left in range(1, n + 1):
        rows = subsets[(size <= left) & (size >= left - (n - s))]
        E = np.full((len(rows), m + 1), np.inf)
        after, stay = np.full((len(rows), m + 1, m), np.inf), np.full((len(rows), n), np.inf)
        for j, c in enumerate(home):
            if j in exact:
                bit = 1 << exact.index(j)
                there, source = np.flatnonzero(rows & bit), rows[(rows & bit) > 0] ^ bit
            else:
                there, source = np.arange(len(rows)), rows
            W = prices[j] + np.minimum(to_bin[j] + V[source, :m, c], to_bin[j, c] + V[source, c])
            E[there] = np.minimum(E[there], to_place[j] + prices[j] + Y[source, j, None])
            after[there] = np.minimum(after[there], to_place[j][:, None] + W[:, None])
            stay[there] = np.minimum(stay[there], between[j] + W[:, home])
        after = np.minimum(after, leave + E[:, None, :m])
        after[:, range(m), range(m)] = E[:, :m]
        V, Y = np.full_like(V, np.inf), np.full_like(Y, np.inf)
        V[rows], Y[rows] = after, np.minimum(stay, to_bin[np.arange(n), home] + E[:, home])
    carried = [bins.index(j) for j in problem.onboard]
    if len(carried) == 2:
        a, b = carried
        total = min(leave[m, a] + V[-1, a, b], leave[m, b] + V[-1, b, a])
    else:
        total = V[-1, m, carried[0]] if carried else E[..., m].max()
    return float(total - prices.sum())
