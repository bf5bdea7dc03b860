"""A first plan that is made while its task is still being set up."""

from concurrent.futures import Future, ThreadPoolExecutor

from planner.exact.solver import ExactSolver
from planner.geodesics import Geodesics
from planner.replanner import Replanner
from planner.route import Route, TaskState


class EarlyReplanner(Replanner):
    """A replanner with the exact planner, whose kernels run without the interpreter's lock, that begins in a thread.

    Args:
        geodesics: Distances and paths.
        solver: Finds the tours.
        first: The state in which the task will begin.
        capacity: How many objects can be carried.
    """

    def __init__(
        self, geodesics: Geodesics, solver: ExactSolver, first: TaskState, *, capacity: int = 2
    ) -> None:
        super().__init__(geodesics, solver, capacity=capacity)
        self._begun = first
        thread = ThreadPoolExecutor(1, "first plan")
        self._first: Future[Route] | None = thread.submit(super().update, first, shown=False)
        thread.shutdown(wait=False)

    def update(self, state: TaskState, *, shown: bool = True) -> Route:
        """See :class:`planner.replanner.Replanner`; waits for the first plan."""
        if self._first is not None:
            first, self._first = self._first, None
            first.result()
            if state != self._begun:
                self._route = None
        return super().update(state, shown=shown)
