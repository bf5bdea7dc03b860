"""Routes from a solver: final plans, or first plans at once and better ones from a search in the background."""

import math
import queue
import threading
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

from planner.exact.solver import ExactSolver
from planner.exact.task_table import TaskTable
from planner.exact.warm_start import NOTHING_KNOWN
from planner.geodesics import Geodesics
from planner.plan import Plan, Status, Visit, VisitKind
from planner.problem import RoutingProblem, tour_length
from planner.route import XY, PlanSource, Route, TaskState, remaining
from planner.solvers import SolveLimit, Solver
from planner.task_problems import TaskProblems

MOVED = 0.3  # how far an object may be pushed before a new plan is needed, m
TIE = 0.01  # difference below which tours count as equal, m; rounding to 0.1 mm can add up to this
PROOF_LIMIT = SolveLimit(seconds=20.0)


@dataclass(eq=False)
class _BackgroundSearch:
    """A search for a plan better than the shown visits."""

    problem: RoutingProblem
    plans: Iterator[Plan]  # better and better plans
    stop: threading.Event  # set to stop the search
    shown: tuple[Visit, ...] = ()  # visits of the shown route that remain in `problem`
    # new plans, or the exception that ended the search
    found: "queue.SimpleQueue[Plan | Exception]" = field(default_factory=queue.SimpleQueue)

    def run(self) -> None:
        """Collect plans until there are no more, or `stop` is set."""
        try:
            for plan in self.plans:
                self.found.put(plan)
                if self.stop.is_set():
                    return
        except Exception as error:
            self.found.put(error)

    def drain(self) -> list[Plan]:
        """Return the plans found since the last call, or raise the exception that ended the search."""
        plans: list[Plan] = []
        while not self.found.empty():
            result = self.found.get()
            if isinstance(result, Exception):
                raise result
            plans.append(result)
        return plans

    def bounded(self, other: Plan) -> Plan:
        """Return the plan of the shown visits, with the bound of another plan of the same problem."""
        cost = tour_length(self.problem, self.shown)
        optimal = other.status is Status.OPTIMAL and cost <= other.lower_bound + self.problem.tolerance(cost)
        lower = cost if optimal else min(other.lower_bound, cost)
        status = Status.OPTIMAL if optimal else Status.FEASIBLE
        return Plan(self.shown, cost, lower, status, other.seconds, other.certificate)


class SolverSource(PlanSource):
    """Plans the successive states of a task with a solver. Positions are snapped to the largest island of the navmesh.

    With the exact planner, plans that are not shown start from earlier ones: from a full table if that is small enough,
    else from the multipliers of the bound. The same sequence of states gives the same plans.

    If `start` is set, `plan` returns a first plan within about 50 ms and starts a search for a better one, by default
    for 20 s. The search uses the multipliers of earlier bounds and the order of the route, by object name. Results
    depend on the machine's speed. Only kernels of the exact planner run without the interpreter lock.
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
        self._table = TaskTable(solver) if isinstance(solver, ExactSolver) else None
        self._warm = NOTHING_KNOWN
        self._planned: dict[str, XY] = {}  # positions of the loose objects in the plan
        self._search: _BackgroundSearch | None = None

    def check(self, state: TaskState) -> None:
        self.problems.check(state)

    def rest(self, route: Route, state: TaskState) -> tuple[Visit, ...] | None:
        """Return the remaining visits if the done ones are the first and no object was pushed far, else None."""
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
        """Treat the present route, of another source, as planned in this state."""
        self._planned = dict(state.loose)

    def _follow(self, state: TaskState, visits: tuple[Visit, ...], plan: Plan) -> Route:
        self.adopt(state)
        return Route(visits, plan)

    @property
    def pending(self) -> bool:
        """True if the search has found something since the last call of `better`."""
        return self._search is not None and not self._search.found.empty()

    def better(self, state: TaskState, route: Route) -> Route | None:
        """Return another route if it is shorter by more than rounding from where the person is now.

        Otherwise return the present route with a better bound, or None. So the suggestion does not alternate between
        equal tours.
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
        if new is None:  # the plan begins with visits that were not made: search again from here
            self._show(self._new_search(state, route), rest)
            return None
        if self.problems.length(state, new) < self.problems.length(state, rest) - TIE:
            search.shown = best.visits
            return self._follow(state, new, best)
        bounded = search.bounded(best)
        return Route(rest, bounded) if bounded.improves_on(route.plan) else None

    def close(self) -> None:
        """Stop the search, which ends with its present layer after a fraction of a second."""
        if self._search is not None:
            self._search.stop.set()
        self._search = None

    def _solve(self, problem: RoutingProblem, *, shown: bool) -> Plan:
        """Return a final plan. If it is shown, it depends only on this problem."""
        if shown or self._table is None:
            return self._solver.solve(problem, seed=self._seed, limit=self._limit)
        plan = self._table.plan(problem)
        if plan is None and self._warm.multipliers:
            *_, plan = self._improving(problem, self._limit)
        elif plan is None:
            plan = self._solver.solve(problem, seed=self._seed, limit=self._limit)
        self._warm = self._warm.updated(problem, plan)
        return plan

    def _new_search(self, state: TaskState, route: Route | None) -> _BackgroundSearch:
        """Return a search that starts from the results of earlier ones."""
        self.close()
        problem, stop = self.problems.problem(state), threading.Event()
        picks = () if route is None else (v.object for v in route.visits if v.kind is VisitKind.PICK)
        order = [name for name in picks if name in state.loose]
        moved = self._moved(state, order)
        self._warm = replace(self._warm, order=tuple(name for name in order if name not in moved))
        limit = replace(self._limit or PROOF_LIMIT, stop=stop)
        return _BackgroundSearch(problem, self._improving(problem, limit), stop)

    def _show(self, search: _BackgroundSearch, shown: tuple[Visit, ...]) -> None:
        """Start a search for a plan better than these visits."""
        self._search, search.shown = search, shown
        assert self.start is not None  # noqa: S101 - for the type checker
        self.start(search.run)

    def _improving(self, problem: RoutingProblem, limit: SolveLimit | None) -> Iterator[Plan]:
        if isinstance(self._solver, ExactSolver):
            return self._solver.improve(problem, seed=self._seed, limit=limit, warm=self._warm)
        return self._solver.improve(problem, seed=self._seed, limit=limit)

    def _moved(self, state: TaskState, names: Iterable[str]) -> set[str]:
        """Return the loose objects that are new or were pushed farther than `MOVED` since the plan was made."""
        return {
            name
            for name in names
            if name not in self._planned or math.dist(state.loose[name], self._planned[name]) > MOVED
        }
