"""An independent check that a plan solves a problem; it shares no code with the solvers."""

from planner.bound_checker import proven_bound
from planner.errors import ProblemError
from planner.plan import Plan, Status, VisitKind
from planner.problem import RoutingProblem


def check(problem: RoutingProblem, plan: Plan, tolerance: float = 1e-6) -> float:
    """Replay a plan against the constraints of equation 1 (PAPER section 2), then follow its proof.

    Feasibility and cost are verified for every plan. Of the lower bound, what :func:`proven_bound` can derive anew
    is; where the returned number is lower than `plan.lower_bound`, the rest is the solver's word: a search that
    says it was complete, or a problem too large for the checker.

    Args:
        problem: What the plan claims to solve.
        plan: The plan.
        tolerance: Of lengths, m.

    Returns:
        No tour is shorter than this, m, as far as this check could see for itself.

    Raises:
        ProblemError: A visit that is impossible or repeated, an object left over, a wrong cost, a lower bound
            above the cost, OPTIMAL with a gap, or a certificate that claims more than it proves.
    """
    loose = set(range(len(problem.shipments)))
    shipped: set[int] = set()
    onboard = set(range(len(problem.onboard)))
    here, cost = problem.start, 0.0
    for k, visit in enumerate(plan.visits):
        where = f"visit {k} ({visit})"
        if visit.shipment is not None and visit.onboard is None:
            index, held = visit.shipment, shipped
        elif visit.onboard is not None and visit.shipment is None and visit.kind is VisitKind.PLACE:
            index, held = visit.onboard, onboard
        else:
            raise ProblemError(f"{where} must name either a shipment, or an onboard object to place")
        if visit.kind is VisitKind.PICK:
            if index not in loose:
                raise ProblemError(f"{where} picks what does not lie about")
            loose.remove(index)
            shipped.add(index)
            expected = problem.shipments[index].pickup
        else:
            if index not in held:
                raise ProblemError(f"{where} places what is not carried")
            held.remove(index)
            expected = problem.onboard[index] if held is onboard else problem.shipments[index].delivery
        if visit.location != expected:
            raise ProblemError(f"{where} happens at {visit.location} instead of {expected}")
        if len(shipped) + len(onboard) > problem.capacity:
            raise ProblemError(f"{where} exceeds the capacity of {problem.capacity}")
        cost += float(problem.distances[here, visit.location])
        here = visit.location
    if loose or shipped or onboard:
        raise ProblemError(
            f"never done: {len(loose)} picks, {len(shipped) + len(onboard)} places of carried ones"
        )
    _check_numbers(plan, cost, tolerance)
    return proven_bound(problem, plan)


def _check_numbers(plan: Plan, cost: float, tolerance: float) -> None:
    if abs(cost - plan.cost) > tolerance:
        raise ProblemError(f"the tour is {cost} m long, not {plan.cost} m")
    if not plan.lower_bound <= plan.cost + tolerance:
        raise ProblemError(f"lower bound {plan.lower_bound} m exceeds the cost {plan.cost} m")
    if plan.status is Status.OPTIMAL and plan.cost - plan.lower_bound > tolerance:
        raise ProblemError(f"called optimal with a gap of {plan.cost - plan.lower_bound} m")
    if plan.status is Status.INFEASIBLE:
        raise ProblemError("a plan cannot be infeasible")
