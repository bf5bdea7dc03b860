"""Look up planners by name, and verify the plans and bounds of custom planners."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from experiments.errors import UserCodeError, definition, describe, shown
from experiments.session.user_code import is_own, user_code
from planner.checker import check, replayed
from planner.errors import ProblemError
from planner.exact.solver import ExactSolver
from planner.plan import Plan, Status, Visit, VisitKind
from planner.problem import RoutingProblem
from planner.solvers import SolveLimit, Solver, solver

END = object()  # result of `OwnPlanner._next` if the custom planner yields no more plans
CLAIM_TOLERANCE = 1e-6  # maximum relative error in the length or bound that a planner reports


def planner_named(name: str, *, exact: bool = True) -> Solver:
    """Return the planner with this name. The plans of a custom planner are verified.

    If `exact` is set, the exact planner computes the lower bounds of custom plans. Raises PlannerError if
    there is no planner with this name.
    """
    found = solver(name)
    return OwnPlanner(name, found, ExactSolver() if exact else None) if is_own(found) else found


class OwnPlanner:
    """A custom planner whose plans are verified before use.

    The length, bound and status of each plan are recomputed. A wrong length raises an error. The bound comes
    from the planner `exact`, or from the verification if `exact` is None.
    """

    def __init__(self, name: str, planner: Solver, exact: ExactSolver | None) -> None:
        self.name, self._planner, self._exact = name, planner, exact
        self._what = f"planner {name!r}"

    def solve(self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None) -> Plan:
        """Return the custom planner's plan. Raises UserCodeError if it failed or its plan is not feasible."""
        return self._with_bound(problem, self._asked(problem, seed, limit))

    def improve(
        self, problem: RoutingProblem, *, seed: int = 0, limit: SolveLimit | None = None
    ) -> Iterator[Plan]:
        """Yield the plans of the custom planner, then the last plan again if its bound has improved.

        Raises UserCodeError if the planner failed or a plan is not feasible.
        """
        plan = None
        if hasattr(self._planner, "improve"):
            with user_code(self._planner, self._what):
                plans = iter(self._planner.improve(_copied(problem), seed=seed, limit=limit))
            while (given := self._next(plans)) is not END:
                plan = self._checked(problem, given)
                yield plan
        else:
            plan = self._asked(problem, seed, limit)
            yield plan
        if plan is None:
            raise UserCodeError(f"{self._what} gave no plan{definition(self._planner.improve)}")
        bounded = self._with_bound(problem, plan)
        if bounded.improves_on(plan):
            yield bounded

    def _next(self, plans: Iterator[Plan]) -> object:
        with user_code(self._planner, self._what):
            return next(plans, END)

    def _asked(self, problem: RoutingProblem, seed: int, limit: SolveLimit | None) -> Plan:
        with user_code(self._planner, self._what):
            given = self._planner.solve(_copied(problem), seed=seed, limit=limit)
        return self._checked(problem, given)

    def _checked(self, problem: RoutingProblem, given: Any) -> Plan:
        where = definition(self._planner.solve)
        if not isinstance(given, Plan):
            raise UserCodeError(f"{self._what} answered {shown(given)}; it must be a Plan{where}")
        try:
            visits = tuple(Visit(VisitKind(kind), name) for kind, name in given.visits)
            said = Plan(visits, given.cost, given.lower_bound, given.status, given.seconds)
            cost = replayed(problem, said)
            close = problem.tolerance(cost) + CLAIM_TOLERANCE * cost
            if abs(cost - said.cost) > close:
                raise ProblemError(f"the tour is {cost:.6f} m long, not {said.cost:.6f} m")
            if said.lower_bound > cost + close:
                raise ProblemError(
                    f"the lower bound of {said.lower_bound:.6f} m exceeds the cost of {cost:.6f} m"
                )
            plan = Plan(visits, cost, 0.0, Status.FEASIBLE, float(said.seconds))
            return plan.bounded(check(problem, plan), problem.tolerance(cost))
        except Exception as error:  # a custom plan can contain anything, so any error can occur
            raise UserCodeError(
                f"{self._what} gave a plan that does not hold: {describe(error)}{where}"
            ) from error

    def _with_bound(self, problem: RoutingProblem, plan: Plan) -> Plan:
        if self._exact is None or plan.status is Status.OPTIMAL or not self._exact.applies(problem):
            return plan
        return plan.bounded(self._exact.solve(problem).lower_bound, problem.tolerance(plan.cost))


def _copied(problem: RoutingProblem) -> RoutingProblem:
    return replace(problem, distances=problem.distances.copy())
