"""Check plans independently of the solvers.

`check` is fast enough for every plan, whereas `verify_optimal` may take seconds. A certificate provides a
lower bound on the remaining cost of every state. A tour that is shorter than the claimed bound can only visit
states whose cost so far plus this lower bound is below the claim. `verify_optimal` examines all these states.
The claim holds if none of them completes a tour.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.cuts_checker import cuts_bound
from planner.errors import ProblemError
from planner.integer_distances import TOLERANCE
from planner.plan import Certificate, Plan, Proof, Status, VisitKind
from planner.problem import RoutingProblem
from planner.relaxation_checker import Relaxation, closed

EXHAUSTIVE_OBJECTS = 7  # maximum number of objects for which all tours are tried
CHECK_ROWS = 1 << 16  # maximum number of table rows that `check` fills, which takes about 2 s
VERIFY_ROWS = 1 << 20  # maximum number of table rows that `verify_optimal` fills, which takes about 30 s
MAX_STATES = 30_000_000  # maximum number of states that `verify_optimal` visits

# Current location, bit mask of the remaining objects, and bins of the carried objects
State = tuple[int, int, tuple[int, ...]]


def check(problem: RoutingProblem, plan: Plan) -> float:
    """Check a plan and return a lower bound on tour lengths in metres (PAPER section 2, equation 1).

    With up to seven objects, every order of visits is tried. With more objects, the bound results from a
    spanning tree, from the certificate's cuts, or from its table if this table has at most 2^16 rows. Otherwise,
    the bound is 0. The search of the solver is not repeated, so the bound may be below `plan.lower_bound`.

    Raises:
        ProblemError: A visit is impossible or repeated, an object is not delivered, the cost is wrong, the
            lower bound exceeds the cost, an optimal plan has a gap, or the certificate is wrong.
    """
    return derive(problem, plan, CHECK_ROWS)[0]


def derive(problem: RoutingProblem, plan: Plan, max_rows: int) -> tuple[float, Relaxation | None]:
    """Check a plan. Return a lower bound on tour lengths in metres, and the relaxation if it was computed.

    The relaxation is not computed if its table has more than `max_rows` rows.
    """
    _check_numbers(plan, replayed(problem, plan))
    rounding, certificate = allowance(problem, plan), plan.certificate
    if len(problem.shipments) + len(problem.onboard) <= EXHAUSTIVE_OBJECTS:
        shortest = shortest_tour(problem, plan.cost)
        optimum = plan.cost if shortest is None else min(plan.cost, shortest[0])
        _refuse(plan.lower_bound, optimum, rounding, "lower bound")
        return optimum, None
    if certificate is None or certificate.proof is Proof.EXHAUSTIVE:
        return 0.0, None
    relaxation = None
    if certificate.proof is Proof.SPANNING_TREE:
        derived = _spanning_tree(problem)
    elif certificate.proof is Proof.CUTS:
        derived = cuts_bound(problem, certificate)
    else:
        group, prices = _claim(problem, certificate)
        if problem.capacity > 2 or np.prod(np.bincount(group) + 1.0) > max_rows:
            return 0.0, None
        relaxation = Relaxation(problem, group, prices)
        derived = relaxation.root
    if certificate.proof is not Proof.CUTS:  # the bound of cuts is compared in whole units
        _refuse(certificate.root * certificate.unit, derived, rounding, "certificate's root")
    if certificate.proof not in (Proof.RELAXATION, Proof.CUTS):  # a search may have raised these bounds
        _refuse(plan.lower_bound, derived, rounding, "lower bound")
    return derived, relaxation


def allowance(problem: RoutingProblem, plan: Plan) -> float:
    """Return the tolerance for rounding errors in the lengths that a plan reports, in metres."""
    return problem.tolerance(plan.cost) + 2 * (problem.resolution or 0.0)


def shortest_tour(
    problem: RoutingProblem, limit: float, max_states: float = np.inf
) -> tuple[float, int] | None:
    """Return the length of the shortest tour in metres, and the number of visited states.

    The length is infinite if no tour is shorter than `limit` metres. The result is None if more than
    `max_states` states were visited.
    """
    d, direct = problem.distances.tolist(), closed(problem).tolist()
    jobs = [(s.pickup, s.delivery) for s in problem.shipments]

    def farthest(here: int, left: int, carried: tuple[int, ...]) -> float:
        """Return the length of the longest remaining trip, which is a lower bound on the rest of the tour."""
        trips = [direct[here][a] + direct[a][b] for k, (a, b) in enumerate(jobs) if left >> k & 1]
        return max([*trips, *(direct[here][j] for j in carried)], default=0.0)

    layer: dict[State, float] = {(problem.start, (1 << len(jobs)) - 1, tuple(sorted(problem.onboard))): 0.0}
    states = 0
    for _ in range(2 * len(jobs) + len(problem.onboard)):
        after: dict[State, float] = {}
        for (here, left, carried), cost in layer.items():
            options = [(j, left, carried[:k] + carried[k + 1 :]) for k, j in enumerate(carried)]
            if len(carried) < problem.capacity:
                options += [
                    (a, left ^ 1 << k, tuple(sorted((*carried, b))))
                    for k, (a, b) in enumerate(jobs)
                    if left >> k & 1
                ]
            for option in options:
                total = cost + d[here][option[0]]
                if total < after.get(option, limit) and total + farthest(*option) < limit:
                    after[option] = total
        layer = after
        states += len(layer)
        if states > max_states:
            return None
    return min(layer.values(), default=np.inf), states


def replayed(problem: RoutingProblem, plan: Plan) -> float:
    """Return the length of a plan's tour in metres. Raises ProblemError if a visit is not feasible."""
    n = len(problem.shipments)
    loose, held = set(range(n)), set(range(n, len(problem.names)))
    here, cost = problem.start, 0.0
    for k, visit in enumerate(plan.visits):
        where = f"visit {k} ({visit.kind.value} {visit.object})"
        if visit.object not in problem.number:
            raise ProblemError(f"{where} names an unknown object; the problem has {list(problem.names)}")
        index = problem.number[visit.object]
        if visit.kind is VisitKind.PICK:
            if index not in loose:
                raise ProblemError(f"{where} picks an object that is not loose")
            loose.remove(index)
            held.add(index)
            there = problem.shipments[index].pickup
        else:
            if index not in held:
                raise ProblemError(f"{where} places an object that is not carried")
            held.remove(index)
            there = problem.onboard[index - n] if index >= n else problem.shipments[index].delivery
        if len(held) > problem.capacity:
            raise ProblemError(f"{where} exceeds the capacity of {problem.capacity}")
        cost += float(problem.distances[here, there])
        here = there
    if loose or held:
        raise ProblemError(f"never done: {len(loose)} picks, {len(held)} places of carried ones")
    return cost


def _check_numbers(plan: Plan, cost: float) -> None:
    tolerance = TOLERANCE * cost
    if abs(cost - plan.cost) > tolerance:
        raise ProblemError(f"the tour is {cost} m long, not {plan.cost} m")
    if not plan.lower_bound <= plan.cost + tolerance:
        raise ProblemError(f"lower bound {plan.lower_bound} m exceeds the cost {plan.cost} m")
    if plan.status is Status.OPTIMAL and plan.cost - plan.lower_bound > tolerance:
        raise ProblemError(f"called optimal with a gap of {plan.cost - plan.lower_bound} m")
    if plan.status is Status.INFEASIBLE:
        raise ProblemError("a plan cannot be infeasible")


def _refuse(claimed: float, derived: float, rounding: float, what: str) -> None:
    if claimed > derived + rounding:
        raise ProblemError(f"the {what} claims {claimed} m, but its proof yields only {derived} m")


def _claim(
    problem: RoutingProblem, certificate: Certificate
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
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


def _spanning_tree(problem: RoutingProblem) -> float:
    direct, total = closed(problem), 0.0
    apart = {j: direct[problem.start, j] for j in problem.used if j != problem.start}
    while apart:
        nearest = min(apart, key=apart.__getitem__)
        total += float(apart.pop(nearest))
        apart = {j: min(length, direct[nearest, j]) for j, length in apart.items()}
    return total


@dataclass(frozen=True)
class Verified:
    """The result of verifying a plan independently of its solver."""

    cost: float  # length of the plan's tour in metres
    lower_bound: float  # verified lower bound on tour lengths in metres
    optimal: bool  # True if the bound equals the tour length, apart from rounding errors
    states: int  # number of states visited by the search
    why: str = ""  # reason why the plan's lower bound was not verified, or an empty string


def verify_optimal(problem: RoutingProblem, plan: Plan, *, max_states: int = MAX_STATES) -> Verified:
    """Verify a plan and, if possible, its lower bound, using only the problem and the certificate.

    The search stops after visiting `max_states` states.

    Raises:
        ProblemError: The tour is not feasible or has another length, the certificate claims more than it proves, or
            there is a tour shorter than the lower bound.
    """
    derived, relaxation = derive(problem, plan, VERIFY_ROWS)
    rounding, proof = allowance(problem, plan), plan.certificate and plan.certificate.proof
    wanted = plan.lower_bound - rounding
    states, why = 0, ""
    if derived >= wanted:
        pass
    elif proof is Proof.SPANNING_TREE:
        why = "a spanning tree bounds the tour no better"
    elif plan.certificate is not None and proof is Proof.CUTS:
        why = f"branch and bound ({plan.certificate.branched} nodes) raised the bound of the cuts and is not repeated"
    elif proof in (Proof.FULL_TABLE, Proof.RELAXATION) and problem.capacity <= 2 and relaxation is None:
        why = f"the certificate's table has more than {VERIFY_ROWS} rows"
    elif (found := _shorter(problem, relaxation, wanted, max_states)) is None:
        states, why = max_states, f"more than {max_states} states may lead to a shorter tour"
    elif found[0]:
        raise ProblemError(f"the lower bound claims {plan.lower_bound} m, but there is a shorter tour")
    else:
        derived, states = wanted, found[1]
    optimal = derived >= plan.cost - 2 * rounding
    return Verified(plan.cost, min(derived, plan.cost), optimal, states, why)


def _shorter(
    problem: RoutingProblem, relaxation: Relaxation | None, limit: float, max_states: int
) -> tuple[bool, int] | None:
    if relaxation is not None:
        found = relaxation.shorter(limit, max_states)
        if found is None or not found[0] or relaxation.exact:
            return found  # otherwise, the tour may use shortcuts that the given distances do not contain
    shortest = shortest_tour(problem, limit, max_states // 30)
    return None if shortest is None else (shortest[0] < limit, shortest[1])
