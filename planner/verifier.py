"""Whether a plan is optimal, by code that it does not share with the solvers; this may take seconds.

A certificate says how to bound the rest of the task from every state. With that bound, a tour shorter than claimed
could only run through states whose cost so far plus bound stays below the claim. All of these are looked at, layer by
layer of picks. If none of them is the end of a tour, the claim holds.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.bound_checker import allowance, claim
from planner.certificate import Proof
from planner.checker import check
from planner.errors import ProblemError
from planner.plan import Plan
from planner.problem import RoutingProblem
from planner.relaxation_checker import Lengths, Relaxed, relax
from planner.tour_sweep import sweep_orders

MAX_STATES = 30_000_000
MAX_ROWS = 1 << 20  # of the certificate's table: some 30 s


@dataclass(frozen=True)
class Verified:
    """What is true of a plan, found without trusting its solver.

    Attributes:
        cost: Length of its tour, m, which is feasible.
        lower_bound: No tour is shorter than this, m.
        optimal: Whether that is the length of the tour, to twice the tolerance of the problem.
        states: How many states were looked at beyond the certificate's table.
        why: What is not verified and why, empty where everything the plan claims is.
    """

    cost: float
    lower_bound: float
    optimal: bool
    states: int
    why: str = ""


def verify_optimal(problem: RoutingProblem, plan: Plan, *, max_states: int = MAX_STATES) -> Verified:
    """Check a plan's tour, and its lower bound as far as possible, from the problem and the certificate alone.

    Args:
        problem: What the plan claims to solve.
        plan: The plan; OPTIMAL or not, its claim is its lower bound.
        max_states: Give up beyond so many states.

    Returns:
        What could be verified, which is less than the plan claims only where it says `why`.

    Raises:
        ProblemError: The tour is not feasible or not as long as claimed, the certificate claims more than it proves,
            or there is a tour shorter than the lower bound.
    """
    derived = check(problem, plan)
    rounding = allowance(problem, plan)
    wanted = plan.lower_bound - rounding
    states, why = 0, ""
    if derived < wanted:
        derived, states, why = _by_search(problem, plan, derived, wanted, max_states)
    optimal = derived >= plan.cost - 2 * rounding
    return Verified(plan.cost, min(derived, plan.cost), optimal, states, why)


def _by_search(
    problem: RoutingProblem, plan: Plan, derived: float, wanted: float, max_states: int
) -> tuple[float, int, str]:
    """A lower bound, how many states it took, and what is missing."""
    certificate = plan.certificate
    if problem.capacity != 2 or certificate is None or certificate.proof is Proof.EXHAUSTIVE:
        found = sweep_orders(problem, wanted, max_states // 30)
    elif certificate.proof is Proof.SPANNING_TREE:
        return derived, 0, "a spanning tree bounds the tour no better"
    else:
        group, prices = claim(problem, certificate)
        rows = int(np.prod(np.bincount(group) + 1.0))
        if rows > MAX_ROWS:
            return derived, 0, f"the certificate's table has {rows} rows, more than {MAX_ROWS}"
        table = relax(problem, group, prices)
        derived = max(derived, table.root)
        if derived >= wanted:
            return derived, 0, ""
        found = sweep(problem, table, wanted, max_states)
        if found is not None and found[0] and not np.array_equal(table.d, problem.distances):
            found = sweep_orders(
                problem, wanted, max_states // 30
            )  # it may take legs that the given distances lack
    if found is None:
        return derived, max_states, f"more than {max_states} states may lead to a shorter tour"
    shortest, states = found
    if shortest:
        raise ProblemError(f"the lower bound claims {plan.lower_bound} m, but there is a shorter tour")
    return wanted, states, ""


def sweep(problem: RoutingProblem, table: Relaxed, limit: float, max_states: int) -> tuple[bool, int] | None:
    """Look for a tour shorter than a limit, m, among the states that may lead to one.

    A state is the set of objects left and a place: bin b with an object for bin c in hand is b m + c, with empty
    hands b m + b, and object i with only that in hand m m + i.

    Returns:
        Whether there is one, and how many states were looked at; None if they were too many.
    """
    n, m = len(table.at), len(table.bins)
    limit += float(table.price.sum())
    here, after = _begin(problem, table)
    states = 0
    for _ in range(n + 1):
        here = _shortest([here, _dropped(table, _promising(table, here, limit))], table, limit)
        states += len(here[0])
        if states > max_states:
            return None
        left, place, cost = here
        if ((left == 0) & (place < m * m) & (place // max(m, 1) == place % max(m, 1))).any():
            return True, states
        parts = [after]
        for j in range(n):
            there = (left >> j & 1).astype(bool)
            parts += [
                _promising(table, part, limit)
                for part in _picked(table, j, left[there], place[there], cost[there])
            ]
        here, after = _shortest(parts, table, limit), _none()
    return False, states


States = tuple[NDArray[np.int64], NDArray[np.int64], Lengths]  # objects left, place, cost with prices, m


def _none() -> States:
    return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0)


def _states(left: NDArray[np.int64], place: NDArray[np.int64], cost: Lengths) -> States:
    return left, np.broadcast_to(np.asarray(place, np.int64), left.shape), cost


def _begin(problem: RoutingProblem, table: Relaxed) -> tuple[States, States]:
    """States after the first leg: those with all objects left, and those with one picked."""
    n, m = len(table.at), len(table.bins)
    d, start = table.d, problem.start
    everything = (1 << n) - 1
    bins = table.bins.tolist()
    held = [bins.index(j) for j in problem.onboard]
    dropped = [(b, held[1 - k] if len(held) == 2 else b) for k, b in enumerate(held)]
    here = _states(
        np.full(len(dropped), everything),
        np.array([b * m + c for b, c in dropped], np.int64),
        np.array([d[start, table.bins[b]] for b, _ in dropped], np.float64),
    )
    after: list[tuple[int, int, float]] = []
    for j in range(n if len(held) < 2 else 0):
        c, left = int(table.home[j]), everything ^ 1 << j
        arrived = float(d[start, table.at[j]] + table.price[j])
        if not held:
            after.append((left, m * m + j, arrived))
        for b, other in {(held[0], c), (c, held[0])} if held else ():
            after.append((left, b * m + other, arrived + float(d[table.at[j], table.bins[b]])))
    places = np.array([state[:2] for state in after], np.int64).reshape(-1, 2)
    return here, (places[:, 0], places[:, 1], np.array([state[2] for state in after]))


def _dropped(table: Relaxed, states: States) -> States:
    """Where a leg to the bin of the one object in hand leads."""
    left, place, cost = states
    m = len(table.bins)
    at_bin = place < m * m
    where = np.where(at_bin, table.bins[np.minimum(place, m * m - 1) // m] if m else 0, 0)
    goal = np.where(at_bin, place % max(m, 1), 0)
    objects = place[~at_bin] - m * m
    where[~at_bin], goal[~at_bin] = table.at[objects], table.home[objects]
    full = ~(at_bin & (place // max(m, 1) == goal))
    legs = table.d[where[full], table.bins[goal[full]]]
    return _states(left[full], goal[full] * m + goal[full], cost[full] + legs)


def _picked(
    table: Relaxed, j: int, left: NDArray[np.int64], place: NDArray[np.int64], cost: Lengths
) -> list[States]:
    """Where a leg to object j leads, and with two in hand the leg to either bin."""
    m, c = len(table.bins), int(table.home[j])
    at_bin = place < m * m
    where, held = np.empty_like(place), np.empty_like(place)
    where[at_bin], held[at_bin] = table.bins[place[at_bin] // m], place[at_bin] % m
    objects = place[~at_bin] - m * m
    where[~at_bin], held[~at_bin] = table.at[objects], table.home[objects]
    cost = cost + table.d[where, table.at[j]] + table.price[j]
    left = left ^ 1 << j
    empty = at_bin & (place // m == held)
    full = ~empty
    d, rest = held[full], left[full]
    return [
        _states(left[empty], np.full(empty.sum(), m * m + j), cost[empty]),
        _states(rest, d * m + c, cost[full] + table.d[table.at[j], table.bins[d]]),
        _states(rest, c * m + d, cost[full] + table.d[table.at[j], table.bins[c]]),
    ]


def _promising(table: Relaxed, states: States, limit: float) -> States:
    """Those from which a tour shorter than the limit may exist."""
    left, place, cost = states
    m = len(table.bins)
    row = np.zeros(len(left), np.int64)
    for j, stride in enumerate(table.stride.tolist()):
        row += stride * (left >> j & 1)
    rest = np.empty(len(left))
    at_bin = place < m * m
    rest[at_bin] = table.carrying.reshape(len(table.carrying), -1)[row[at_bin], place[at_bin]]
    rest[~at_bin] = table.holding[row[~at_bin], place[~at_bin] - m * m]
    good = cost + rest < limit
    return left[good], place[good], cost[good]


def _shortest(parts: list[States], table: Relaxed, limit: float) -> States:
    """The shortest path to each state, of those that may lead to a shorter tour."""
    left, place, cost = (np.concatenate([part[k] for part in parts]) for k in range(3))
    left, place, cost = _promising(table, (left, place, cost), limit)
    order = np.lexsort((cost, place, left))
    left, place, cost = left[order], place[order], cost[order]
    first = np.ones(len(left), bool)
    first[1:] = (left[1:] != left[:-1]) | (place[1:] != place[:-1])
    return left[first], place[first], cost[first]
