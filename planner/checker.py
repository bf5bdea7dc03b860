"""An independent check that a plan solves a problem; it shares no code with the solvers."""

from planner.bound_checker import proven_bound
from planner.errors import ProblemError
from planner.integer_distances import TOLERANCE
from planner.plan import Plan, Status, VisitKind
from planner.problem import RoutingProblem


def check(problem: RoutingProblem, plan: Plan) -> float:
    """Replay a plan against the constraints of equation 1 (PAPER section 2), then follow its proof.

    Feasibility and cost are verified for every plan. Of the lower bound, what :func:`proven_bound` can derive anew
    is; where the returned number is lower than `plan.lower_bound`, the rest was not checked: it rests on a search that
    says it was complete, or a problem too large for the checker.

    Args:
        problem: What the plan claims to solve.
        plan: The plan.

    Returns:
        A lower bound of all tours that this check has derived by itself, m.

    Raises:
        ProblemError: A visit that is impossible or repeated, an object left over, a wrong cost, a lower bound
            above the cost, OPTIMAL with a gap, or a certificate that claims more than it proves.
    """
    _check_numbers(plan, _replayed(problem, plan))
    return proven_bound(problem, plan)


def _replayed(problem: RoutingProblem, plan: Plan) -> float:
    """Length of the tour, m, every visit of which is feasible."""
    n = len(problem.shipments)
    number = {name: k for k, name in enumerate(problem.names)}
    loose, held = set(range(n)), set(range(n, len(problem.names)))
    here, cost = problem.start, 0.0
    for k, (kind, name) in enumerate(plan.visits):
        where = f"visit {k} ({kind.value} {name})"
        if name not in number:
            raise ProblemError(f"{where} is of no object of the problem; it has {list(number)}")
        index = number[name]
        if kind is VisitKind.PICK:
            if index not in loose:
                raise ProblemError(f"{where} picks what does not lie about")
            loose.remove(index)
            held.add(index)
            there = problem.shipments[index].pickup
        else:
            if index not in held:
                raise ProblemError(f"{where} places what is not carried")
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
