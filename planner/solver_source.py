"""Routes from a solver: one final plan, or a first plan at once and better ones from a search in the background."""

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
from planner.problem import RoutingProblem
from planner.route import XY, PlanSource, Route, TaskState, remaining
from planner.solvers import SolveLimit, Solver
from planner.task_problems import TaskProblems
from planner.tour import tour_length

MOVED = 0.3  # m; an object that was pushed farther than this since it was planned for asks for a new plan
TIE = 0.01  # m; tours closer than this are equal: rounding to 0.1 mm alone can add up to it
PROOF_LIMIT = SolveLimit(seconds=20.0)


@dataclass(eq=False)
class _Search:
    """A search for something better than the visits on show."""

    problem: RoutingProblem  # the problem that is solved
    plans: Iterator[Plan]  # better and better plans of it
    stop: threading.Event  # set to stop it
    shown: tuple[Visit, ...] = ()  # the visits on show, from the state of the problem on
    # plans not yet looked at, or the exception that ended the search
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
        """Plans since the last call; raises the exception that ended the search."""
        plans: list[Plan] = []
        while not self.found.empty():
            result = self.found.get()
            if isinstance(result, Exception):
                raise result
            plans.append(result)
        return plans

    def bounded(self, other: Plan) -> Plan:
        """The plan of the shown visits, with the bound of another plan of the same problem."""
        cost = tour_length(self.problem, self.shown)
        optimal = other.status is Status.OPTIMAL and cost <= other.lower_bound + self.problem.tolerance(cost)
        lower = cost if optimal else min(other.lower_bound, cost)
        status = Status.OPTIMAL if optimal else Status.FEASIBLE
        return Plan(self.shown, cost, lower, status, other.seconds, other.certificate)


class SolverSource(PlanSource):
    """Plans the successive states of a task with a solver; positions are snapped to the largest island of the navmesh.

    With the exact planner, plans that are not shown start from earlier ones: a full table where that is small enough,
    else the multipliers of the bound. The same sequence of states gives the same plans.

    With `start`, `plan` gives a first plan within some 50 ms, and a search for a better one starts, by default for
    20 s. It knows from earlier ones, by name of the object, the multipliers of the bound and the order of the route.
    Results depend on the machine's speed. Only the exact planner's kernels run without the interpreter's lock.
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
        self._planned: dict[str, XY] = {}  # where the loose objects of the route lay when it was planned
        self._search: _Search | None = None

    def check(self, state: TaskState) -> None:
        """See `PlanSource`."""
        self.problems.check(state)

    def rest(self, route: Route, state: TaskState) -> tuple[Visit, ...] | None:
        """The visits left if those done are the first of the route and no object was pushed far, else None."""
        return None if self._moved(state, state.loose) else remaining(route.visits, state)

    def plan(self, state: TaskState, route: Route | None, *, shown: bool) -> Route:
        """See `PlanSource`."""
        if self.start is None:
            plan = self._solve(self.problems.problem(state), shown=shown)
            return self._follow(state, plan.visits, plan)
        search = self._new_search(state, route)
        plan = next(search.plans)
        self._warm = self._warm.updated(search.problem, plan)
        self._show(search, plan.visits)
        return self._follow(state, plan.visits, plan)

    def adopt(self, state: TaskState) -> None:
        """Take the present route, of another source, for one that was planned in this state."""
        self._planned = dict(state.loose)

    def _follow(self, state: TaskState, visits: tuple[Visit, ...], plan: Plan) -> Route:
        self.adopt(state)
        return Route(visits, plan)

    @property
    def pending(self) -> bool:
        """Whether the search has found something since the last call of `better`."""
        return self._search is not None and not self._search.found.empty()

    def better(self, state: TaskState, route: Route) -> Route | None:
        """The route stays unless another is shorter by more than rounding, from where the person is now.

        So among equals the suggestion does not switch. Costs nothing if the search has found nothing.
        """
        search = self._search
        plans = search.drain() if search is not None else []
        rest = self.rest(route, state) if plans else None
        if search is None or rest is None:
            return None  # nothing new, or another plan is due
        for plan in plans:
            self._warm = self._warm.updated(search.problem, plan)
        best = plans[-1]
        new = remaining(best.visits, state)
        if new is None:  # its first visits are not those done since: search anew, from here
            self._show(self._new_search(state, route), rest)
            return None
        if self.problems.length(state, new) < self.problems.length(state, rest) - TIE:
            search.shown = best.visits
            return self._follow(state, new, best)
        bounded = search.bounded(best)
        return Route(rest, bounded) if bounded.improves_on(route.plan) else None

    def close(self) -> None:
        """Stop the search; it ends with its current layer, a fraction of a second later."""
        if self._search is not None:
            self._search.stop.set()
        self._search = None

    def _solve(self, problem: RoutingProblem, *, shown: bool) -> Plan:
        """A final plan; one that is shown depends on this problem alone."""
        if shown or self._table is None:
            return self._solver.solve(problem, seed=self._seed, limit=self._limit)
        plan = self._table.plan(problem)
        if plan is None and self._warm.multipliers:
            *_, plan = self._improving(problem, self._limit)
        elif plan is None:
            plan = self._solver.solve(problem, seed=self._seed, limit=self._limit)
        self._warm = self._warm.updated(problem, plan)
        return plan

    def _new_search(self, state: TaskState, route: Route | None) -> _Search:
        """A search that starts from what is known of earlier ones."""
        self.close()
        problem, stop = self.problems.problem(state), threading.Event()
        picks = () if route is None else (v.object for v in route.visits if v.kind is VisitKind.PICK)
        order = [name for name in picks if name in state.loose]
        moved = self._moved(state, order)
        self._warm = replace(self._warm, order=tuple(name for name in order if name not in moved))
        limit = replace(self._limit or PROOF_LIMIT, stop=stop)
        return _Search(problem, self._improving(problem, limit), stop)

    def _show(self, search: _Search, shown: tuple[Visit, ...]) -> None:
        """Start a search for something better than these visits."""
        self._search, search.shown = search, shown
        assert self.start is not None  # noqa: S101 - for the type checker
        self.start(search.run)

    def _improving(self, problem: RoutingProblem, limit: SolveLimit | None) -> Iterator[Plan]:
        if isinstance(self._solver, ExactSolver):
            return self._solver.improve(problem, seed=self._seed, limit=limit, warm=self._warm)
        return self._solver.improve(problem, seed=self._seed, limit=limit)

    def _moved(self, state: TaskState, names: Iterable[str]) -> set[str]:
        """Those of some loose objects that were pushed farther than `MOVED` since the plan was made, or are new."""
        return {
            name
            for name in names
            if name not in self._planned or math.dist(state.loose[name], self._planned[name]) > MOVED
        }
