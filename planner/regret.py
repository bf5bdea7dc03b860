"""What each possible next visit costs compared with the best one."""

from dataclasses import dataclass

from planner.errors import ProblemError
from planner.plan import Status, Visit, VisitKind
from planner.problem import RoutingProblem
from planner.solver import SolveLimit, Solver
from planner.tour import possible_next


@dataclass(frozen=True)
class Regret:
    """A possible next visit.

    Attributes:
        visit: What is done next.
        cost: Length of the rest of the task if it is done next and the solver plans the rest, m.
        regret: By how much that exceeds the least such cost, m.
        proven: Whether the solver proved the rest optimal after this visit.
    """

    visit: Visit
    cost: float
    regret: float
    proven: bool


def after(problem: RoutingProblem, visit: Visit) -> RoutingProblem:
    """What is left to do once a visit has been made; shipments and onboard keep their order.

    Raises:
        ProblemError: Capacity or precedence do not allow the visit now.
    """
    if visit not in possible_next(problem, ()):
        raise ProblemError(f"{visit} is not possible now; choose one of possible_next")
    shipments, onboard = list(problem.shipments), list(problem.onboard)
    if visit.kind is VisitKind.PICK and visit.shipment is not None:
        onboard.append(shipments.pop(visit.shipment).delivery)
    elif visit.onboard is not None:
        onboard.pop(visit.onboard)
    return RoutingProblem(
        problem.distances, visit.location, tuple(shipments), tuple(onboard), problem.capacity
    )


def regrets(
    problem: RoutingProblem, solver: Solver, *, seed: int = 0, limit: SolveLimit | None = None
) -> tuple[Regret, ...]:
    """Solve the rest of the task after each possible next visit, the best visit first.

    Args:
        problem: What is left to do.
        solver: Plans the rest; with the exact one, regrets are exact where `proven`.
        seed: Handed to the solver.
        limit: Handed to the solver, for each visit anew.
    """
    found = []
    for visit in possible_next(problem, ()):
        plan = solver.solve(after(problem, visit), seed=seed, limit=limit)
        cost = float(problem.distances[problem.start, visit.location]) + plan.cost
        found.append((cost, visit, plan.status is Status.OPTIMAL))
    least = min((cost for cost, _, _ in found), default=0.0)
    ranked = sorted(found, key=lambda entry: entry[0])
    return tuple(Regret(visit, cost, cost - least, proven) for cost, visit, proven in ranked)
