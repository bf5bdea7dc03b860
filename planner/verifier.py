"""Whether a plan is optimal, by code that it does not share with the solvers; this may take seconds.

A certificate says how to bound the rest of the task from every state. With that bound, a tour shorter than claimed
could only run through states whose cost so far plus bound stays below the claim. All of these are visited, layer by
layer of picks. If none of them is the end of a tour, the claim holds.
"""

from dataclasses import dataclass

from planner.certificate import Proof
from planner.checker import allowance, derive, shortest_tour
from planner.errors import ProblemError
from planner.plan import Plan
from planner.problem import RoutingProblem
from planner.relaxation_checker import Relaxation

MAX_STATES = 30_000_000
MAX_ROWS = 1 << 20  # of the certificate's table: some 30 s


@dataclass(frozen=True)
class Verified:
    """What is true of a plan, found without trusting its solver."""

    cost: float  # length of its tour, m, which is feasible
    lower_bound: float  # no tour is shorter than this, m
    optimal: bool  # whether that is the length of the tour, to twice the tolerance of the problem
    states: int  # how many states were visited beyond the certificate's table
    why: str = ""  # what is not verified and why, empty where everything the plan claims is


def verify_optimal(problem: RoutingProblem, plan: Plan, *, max_states: int = MAX_STATES) -> Verified:
    """Check a plan's tour, and its lower bound as far as possible, from the problem and the certificate alone.

    OPTIMAL or not, a plan's claim is its lower bound. A search gives up beyond `max_states`.

    Raises:
        ProblemError: The tour is not feasible or not as long as claimed, the certificate claims more than it proves,
            or there is a tour shorter than the lower bound.
    """
    derived, relaxation = derive(problem, plan, MAX_ROWS)
    rounding, proof = allowance(problem, plan), plan.certificate and plan.certificate.proof
    wanted = plan.lower_bound - rounding
    states, why = 0, ""
    if derived >= wanted:
        pass
    elif proof is Proof.SPANNING_TREE:
        why = "a spanning tree bounds the tour no better"
    elif proof in (Proof.FULL_TABLE, Proof.RELAXATION) and problem.capacity <= 2 and relaxation is None:
        why = f"the certificate's table has more than {MAX_ROWS} rows"
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
    """Whether a tour shorter than a limit, m, exists, and how many states that took; None if too many."""
    if relaxation is not None:
        found = relaxation.shorter(limit, max_states)
        if found is None or not found[0] or relaxation.exact:
            return found  # else the tour may take legs that the given distances lack
    shortest = shortest_tour(problem, limit, max_states // 30)
    return None if shortest is None else (shortest[0] < limit, shortest[1])
