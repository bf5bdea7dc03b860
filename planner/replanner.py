"""Planning alongside a task in progress: keep the plan while it is followed, else replan (PAPER section 2)."""

import math
from collections.abc import Iterable

from planner.errors import PlannerError
from planner.exact.solver import ExactSolver
from planner.exact.task_solver import TaskSolver
from planner.geodesics import Geodesics
from planner.plan import Visit
from planner.route import XY, Route, TaskState, remaining
from planner.solver import SolveLimit, Solver
from planner.task_problems import TaskProblems

MOVED = 0.3  # m; an object that was pushed farther than this since it was planned for asks for a new plan


class Replanner:
    """Plans the rest of a task again whenever the person departs from the plan.

    Every position stands for the nearest point of the navmesh's largest island.

    Args:
        geodesics: Distances and paths.
        solver: Finds the tours.
        capacity: How many objects can be carried.
        seed: Handed to the solver.
        limit: Handed to the solver.

    Attributes:
        problems: Makes the routing problems.
        replans: How often `update` made a new plan because the old one no longer fitted.
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
        self.replans = 0
        self._solver = solver
        self._task_solver = TaskSolver(solver) if isinstance(solver, ExactSolver) else solver
        self._seed = seed
        self._limit = limit
        self._route: Route | None = None
        self._planned: dict[str, XY] = {}  # where the loose objects of the route lay when it was planned

    @property
    def route(self) -> Route:
        """The current route.

        Raises:
            PlannerError: Nothing was planned yet.
        """
        if self._route is None:
            raise PlannerError("no route yet; call plan or update with the state of the task first")
        return self._route

    def plan(self, state: TaskState) -> Route:
        """Plan the rest of the task anew and follow that from now on.

        Raises:
            UnreachableError: Objects that cannot be fetched or delivered; `names` lists them.
            ProblemError: More is carried than the capacity allows.
        """
        return self._plan(state, self._solver)

    def _plan(self, state: TaskState, solver: "Solver | TaskSolver") -> Route:
        plan = solver.solve(self.problems.problem(state), seed=self._seed, limit=self._limit)
        return self._follow(Route(plan.visits, plan), state)

    def prepare(self, state: TaskState, *, seconds: float | None = None) -> Route:  # noqa: ARG002 - it never waits
        """Plan the task before its clock starts.

        Args:
            state: The task at its start.
            seconds: Longest wait for proofs in the background, if the replanner makes them.
        """
        return self.plan(state)

    def adopt(self, route: Route, state: TaskState) -> None:
        """Follow a route that was planned elsewhere, such as before an interruption."""
        self._follow(route, state)

    @property
    def pending(self) -> bool:
        """Whether `poll` would find something new; never for this replanner."""
        return False

    def poll(self, state: TaskState) -> Route | None:  # noqa: ARG002 - nothing goes on in the background
        """A better route than the present one, if one was found meanwhile; this replanner finds none."""
        return None

    def update(self, state: TaskState, *, shown: bool = True) -> Route:
        """The route for the task as it is now.

        If what was done since is the beginning of the route, the rest of it stays; otherwise (or if an object was
        pushed far) the task is planned anew and `replans` goes up by one.

        Args:
            state: The task as it is now.
            shown: Whether somebody sees the plan. It then depends on this state alone. One that nobody sees starts from
                what earlier ones have found: several times quicker, but of equally short tours it may be another.

        Raises:
            UnreachableError: Objects that cannot be fetched or delivered; `names` lists them.
            ProblemError: More is carried than the capacity allows.
        """
        rest = None if self._route is None else self._rest(state)
        if self._route is None or rest is None:
            self.replans += self._route is not None
            return self.plan(state) if shown else self._plan(state, self._task_solver)
        self._route = Route(rest, self._route.plan)
        return self._route

    def _follow(self, route: Route, state: TaskState) -> Route:
        self._route, self._planned = route, dict(state.loose)
        return route

    def _rest(self, state: TaskState) -> tuple[Visit, ...] | None:
        """The visits of the route that are still to be done, or None if the state is not on the route."""
        return None if self._moved(state, state.loose) else remaining(self.route.visits, state)

    def _moved(self, state: TaskState, names: Iterable[str]) -> list[str]:
        """Those of some loose objects that were pushed farther than `MOVED` since the plan was made, or are new."""
        return [
            name
            for name in names
            if name not in self._planned or math.dist(state.loose[name], self._planned[name]) > MOVED
        ]
