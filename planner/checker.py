"""An independent check that a plan solves a problem; it shares no code with the solvers."""

import numpy as np
from numpy.typing import NDArray

from planner.certificate import Certificate, Proof
from planner.errors import ProblemError
from planner.integer_distances import TOLERANCE
from planner.plan import Plan, Status, VisitKind
from planner.problem import RoutingProblem
from planner.relaxation_checker import Relaxation, closed

FEW = 7  # objects whose tours are all tried
MAX_ROWS = 1 << 16  # of a table that is computed anew: some 2 s

# Location, objects left (bits), and the bins of what is carried.
State = tuple[int, int, tuple[int, ...]]


def check(problem: RoutingProblem, plan: Plan) -> float:
    """Replay a plan against the constraints of equation 1 (PAPER section 2), then derive its lower bound anew.

    Up to seven objects every order of visits is tried, whatever the certificate. Beyond, a spanning tree is grown, or
    a table (full, or relaxed with the certificate's groups and prices) filled up to 2^16 rows. A search is not
    repeated: where the returned number is lower than `plan.lower_bound`, the rest was not checked.

    Returns:
        A lower bound of all tours that this check has derived by itself, m; 0 where it could derive none.

    Raises:
        ProblemError: A visit that is impossible or repeated, an object left over, a wrong cost, a lower bound
            above the cost, OPTIMAL with a gap, or a certificate that claims more than it proves.
    """
    return derive(problem, plan, MAX_ROWS)[0]


def derive(problem: RoutingProblem, plan: Plan, max_rows: int) -> tuple[float, Relaxation | None]:
    """As `check`, with a limit on the rows; also the relaxation, where it was filled."""
    _check_numbers(plan, replayed(problem, plan))
    rounding, certificate = allowance(problem, plan), plan.certificate
    if len(problem.shipments) + len(problem.onboard) <= FEW:
        shortest = shortest_tour(problem, plan.cost)
        optimum = plan.cost if shortest is None else min(plan.cost, shortest[0])
        _refuse(plan.lower_bound, optimum, rounding, "lower bound")
        return optimum, None
    if certificate is None or certificate.proof is Proof.EXHAUSTIVE:
        return 0.0, None
    relaxation = None
    if certificate.proof is Proof.SPANNING_TREE:
        derived = _spanning_tree(problem)
    else:
        group, prices = _claim(problem, certificate)
        if problem.capacity > 2 or np.prod(np.bincount(group) + 1.0) > max_rows:
            return 0.0, None
        relaxation = Relaxation(problem, group, prices)
        derived = relaxation.root
    _refuse(certificate.root * certificate.unit, derived, rounding, "certificate's root")
    if certificate.proof is not Proof.RELAXATION:  # the only one with a search behind it
        _refuse(plan.lower_bound, derived, rounding, "lower bound")
    return derived, relaxation


def allowance(problem: RoutingProblem, plan: Plan) -> float:
    """By how much the claims of a plan may exceed the truth, m: rounding to the problem's resolution counts."""
    return problem.tolerance(plan.cost) + 2 * (problem.resolution or 0.0)


def shortest_tour(
    problem: RoutingProblem, limit: float, max_states: float = np.inf
) -> tuple[float, int] | None:
    """Length of the shortest tour below a limit, m, for any capacity and distances, infinite if there is none.

    With it comes how many states were visited, sorted by number of visits made; None if they were too many.
    """
    d, direct = problem.distances.tolist(), closed(problem).tolist()
    jobs = [(s.pickup, s.delivery) for s in problem.shipments]

    def still(here: int, left: int, carried: tuple[int, ...]) -> float:
        """The farthest single trip left."""
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
                if total < after.get(option, limit) and total + still(*option) < limit:
                    after[option] = total
        layer = after
        states += len(layer)
        if states > max_states:
            return None
    return min(layer.values(), default=np.inf), states


def replayed(problem: RoutingProblem, plan: Plan) -> float:
    """Length of the tour, m, every visit of which is feasible."""
    n = len(problem.shipments)
    loose, held = set(range(n)), set(range(n, len(problem.names)))
    here, cost = problem.start, 0.0
    for k, visit in enumerate(plan.visits):
        where = f"visit {k} ({visit.kind.value} {visit.object})"
        if visit.object not in problem.number:
            raise ProblemError(f"{where} is of no object of the problem; it has {list(problem.names)}")
        index = problem.number[visit.object]
        if visit.kind is VisitKind.PICK:
            if index not in loose:
                raise ProblemError(f"{where} picks an object that does not lie about")
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
    """Group of each shipment in a table, (n,), and the price of picking it, m, (n,)."""
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
    """Total length of a minimum spanning tree of all locations of the tour (Prim)."""
    direct, total = closed(problem), 0.0
    apart = {j: direct[problem.start, j] for j in problem.used if j != problem.start}
    while apart:
        nearest = min(apart, key=apart.__getitem__)
        total += float(apart.pop(nearest))
        apart = {j: min(length, direct[nearest, j]) for j, length in apart.items()}
    return total
