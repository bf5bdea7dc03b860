"""A plan source that uses a solver and can improve its plans in the background."""

import math
import queue
import threading
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

from planner.exact.full_table import TaskTable
from planner.exact.solver import ExactSolver
from planner.exact.task_search import TaskSearch
from planner.exact.warm_start import NOTHING_KNOWN
from planner.geodesics import Geodesics
from planner.plan import Plan, Status, Visit, VisitKind
from planner.problem import RoutingProblem, tour_length
from planner.route import XY, PlanSource, Route, TaskState, remaining
from planner.solvers import SolveLimit, Solver
from planner.task_problems import TaskProblems

MOVED = 0.3  # displacement of an object beyond which a new plan is made, in metres
TIE = 0.01  # difference in length below which two tours count as equal, in metres
PROOF_LIMIT = SolveLimit(seconds=20.0)


@dataclass(eq=False)
class _BackgroundSearch:
    problem: RoutingProblem
    plans: Iterator[Plan]
    stop: threading.Event
    shown: tuple[Visit, ...] = ()  # remaining visits of the route shown to the participant
    found: "queue.SimpleQueue[Plan | Exception]" = field(default_factory=queue.SimpleQueue)

    def run(self) -> None:
        try:
            for plan in self.plans:
                self.found.put(plan)
                if self.stop.is_set():
                    return
        except Exception as error:
            self.found.put(error)

    def drain(self) -> list[Plan]:
        """Return the plans found since the last call. Raise the exception if the search has failed."""
        plans: list[Plan] = []
        while not self.found.empty():
            result = self.found.get()
            if isinstance(result, Exception):
                raise result
            plans.append(result)
        return plans

    def bounded(self, other: Plan) -> Plan:
        """Return a plan with the shown visits and the lower bound of another plan."""
        cost = tour_length(self.problem, self.shown)
        plan = replace(other, visits=self.shown, cost=cost)
        # An unproven plan may be within the tolerance for rounding errors, which proves nothing.
        tolerance = self.problem.tolerance(cost) if other.status is Status.OPTIMAL else 0.0
        return plan.bounded(other.lower_bound, tolerance)


class SolverSource(PlanSource):
    """A plan source that calls a solver. Positions are snapped to the largest island of the navmesh.

    With the exact planner, plans that the participant does not see reuse earlier results. These are the full
    table if it is small enough, or else the multipliers of the lower bound. All searches after the first one
    share a budget of states. If the task began with more than 24 objects, this also applies to the first plan and
    to plans that the participant sees. The same sequence of states always gives the same plans.

    If `start` is set, `plan` returns a first plan within about 50 ms and starts a background search for a
    better one, which takes up to 20 s by default. The search reuses the multipliers of earlier bounds and the
    order of objects in the previous route. The results then depend on the machine's speed.
    """

    def __init__(
        self,
        geodesics: Geodesics,
        solver: Solver,
        *,
        capacity: int = 2,
        seed: int = 0,
        limit: SolveLimit | None = None,
    ) -> None:
        self.problems = TaskProblems(geodesics, capacity)
        self._solver, self._seed, self._limit = solver, seed, limit
        exact = solver if isinstance(solver, ExactSolver) else ExactSolver()
        self._table, self._unseen = TaskTable(exact.tabled), TaskSearch(exact, limit)
        self._warm = NOTHING_KNOWN
        self._planned: dict[str, XY] = {}  # positions of the loose objects when the plan was made
        self._search: _BackgroundSearch | None = None

    def rest(self, route: Route, state: TaskState) -> tuple[Visit, ...] | None:
        """Return the remaining visits, or None if the participant deviated or an object was moved far."""
        return None if self._moved(state, state.loose) else remaining(route.visits, state)

    def plan(self, state: TaskState, route: Route | None, *, shown: bool) -> Route:
        if self.start is None:
            plan = self._solve(self.problems.problem(state), shown=shown)
            return self._follow(state, plan.visits, plan)
        search = self._new_search(state, route)
        plan = next(search.plans)
        self._warm = self._warm.updated(search.problem, plan)
        self._show(search, plan.visits)
        return self._follow(state, plan.visits, plan)

    def adopt(self, state: TaskState) -> None:
        """Take over a route that another source has planned for this state."""
        self._planned = dict(state.loose)

    def _follow(self, state: TaskState, visits: tuple[Visit, ...], plan: Plan) -> Route:
        self.adopt(state)
        return Route(visits, plan)

    @property
    def pending(self) -> bool:
        """True if the background search has produced results since the last call to `better`."""
        return self._search is not None and not self._search.found.empty()

    def better(self, state: TaskState, route: Route) -> Route | None:
        """Return an improved route from the background search, or None if there is no improvement.

        A new route must be shorter than the current one by more than `TIE`, so that suggestions do not
        alternate between tours of equal length. Otherwise, the current route may get a better bound.
        """
        search = self._search
        plans = search.drain() if search is not None else []
        rest = self.rest(route, state) if plans else None
        if search is None or rest is None:
            return None
        for plan in plans:
            self._warm = self._warm.updated(search.problem, plan)
        best = plans[-1]
        new = remaining(best.visits, state)
        if new is None:  # the participant has deviated from this plan, so search again
            self._show(self._new_search(state, route), rest)
            return None
        problem = self.problems.problem(state)
        if tour_length(problem, new) < tour_length(problem, rest) - TIE:
            search.shown = best.visits
            return self._follow(state, new, best)
        bounded = search.bounded(best)
        return Route(rest, bounded) if bounded.improves_on(route.plan) else None

    def close(self) -> None:
        """Stop the background search. Its thread ends within a fraction of a second."""
        if self._search is not None:
            self._search.stop.set()
        self._search = None

    def _solve(self, problem: RoutingProblem, *, shown: bool) -> Plan:
        if not isinstance(self._solver, ExactSolver):
            return self._solver.solve(problem, seed=self._seed, limit=self._limit)
        plan = None if shown else self._table.plan(problem)
        if plan is not None:
            return plan
        if self._unseen.continues(problem) or (not shown and self._planned and self._solver.applies(problem)):
            return self._unseen.plan(problem, seed=self._seed, limit=self._limit)
        plan = self._solver.solve(problem, seed=self._seed, limit=self._limit)
        if not shown:
            self._unseen.learn(problem, plan)
        return plan

    def _new_search(self, state: TaskState, route: Route | None) -> _BackgroundSearch:
        self.close()
        problem, stop = self.problems.problem(state), threading.Event()
        picks = () if route is None else (v.object for v in route.visits if v.kind is VisitKind.PICK)
        order = [name for name in picks if name in state.loose]
        moved = self._moved(state, order)
        self._warm = replace(self._warm, order=tuple(name for name in order if name not in moved))
        limit = replace(self._limit or PROOF_LIMIT, stop=stop)
        return _BackgroundSearch(problem, self._improving(problem, limit), stop)

    def _show(self, search: _BackgroundSearch, shown: tuple[Visit, ...]) -> None:
        self._search, search.shown = search, shown
        assert self.start is not None  # noqa: S101 - for the type checker
        self.start(search.run)

    def _improving(self, problem: RoutingProblem, limit: SolveLimit | None) -> Iterator[Plan]:
        if isinstance(self._solver, ExactSolver):
            return self._solver.improve(problem, seed=self._seed, limit=limit, warm=self._warm)
        return self._solver.improve(problem, seed=self._seed, limit=limit)

    def _moved(self, state: TaskState, names: Iterable[str]) -> set[str]:
        return {
            name
            for name in names
            if name not in self._planned or math.dist(state.loose[name], self._planned[name]) > MOVED
        }
