"""What alternatives to the plan cost: computed at once in runs that must repeat, in a thread in live use."""

import contextlib
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from mjsim.episode import CAPACITY
from planner.errors import PlannerError
from planner.geodesics import Geodesics
from planner.plan import Plan, Visit
from planner.regret import Regret
from planner.regret_evaluator import RegretEvaluator, same_state
from planner.route import TaskState
from planner.solver import SolveLimit

# Number of a visit, and what to log its regret as.
Label = tuple[int, tuple[str, ...]]
PATIENCE = 5.0  # s of wall time for the regrets of one state, in live use


class Regrets:
    """Regrets of the possible next visits in the present state of a task, computed when asked for.

    The state is the one after the last visit or mishap, where the plan was last made or followed. Budgets count work,
    so the answers repeat.

    Args:
        geodesics: Distances.
        capacity: How many objects can be carried.
    """

    def __init__(self, geodesics: Geodesics, capacity: int = CAPACITY) -> None:
        self._geodesics, self._capacity = geodesics, capacity
        self._evaluator = RegretEvaluator(geodesics, capacity=capacity)
        self._task: tuple[TaskState, Plan] | None = None

    def prepare(self, state: TaskState, plan: Plan) -> None:
        """Do what takes long before the clock starts."""

    def begin(self, state: TaskState, plan: Plan) -> None:
        """The task is in this state from now on; `plan` is what was planned for it or before."""
        self._task = state, plan

    def known(self) -> Mapping[Visit, Regret]:
        """Of all possible next visits, the best first; empty as long as nothing is known."""
        return {} if self._task is None else self._evaluator.all(*self._task)

    def exact(self, visit: Visit) -> float | None:
        """Regret of one visit, m, also where `known` only has a bound; None where nothing is proven. May take long."""
        if self._task is None:
            return None
        state, plan = self._task
        return self._evaluator.of(state, visit, plan)

    def evaluate(self, label: Label, visit: Visit) -> float | None:  # noqa: ARG002 - nothing is left for later
        """As `exact`, of a visit that is possible now, or None if that comes from `later`, with its label."""
        return self.exact(visit)

    def later(self) -> Iterator[tuple[Label, float | None]]:
        """After the task: labels and exact regrets of visits that were not known in time."""
        return iter(())

    def close(self) -> None:
        """Stop what goes on in the background."""


@dataclass(eq=False)
class _Job:
    """The regrets of one state, being computed in a thread."""

    state: TaskState
    plan: Plan
    stop: threading.Event = field(default_factory=threading.Event)
    found: Mapping[Visit, Regret] | None = None

    def run(self, geodesics: Geodesics, capacity: int) -> None:
        """Find them, unless told to stop. A task that cannot be done is the replanner's to report."""
        limit = SolveLimit(seconds=PATIENCE, stop=self.stop)
        with contextlib.suppress(PlannerError):
            found = RegretEvaluator(geodesics, capacity=capacity, limit=limit).all(self.state, self.plan)
            self.found = None if self.stop.is_set() else found


class LiveRegrets(Regrets):
    """Computes what is `known` in a thread, from the first question about a state on, and never holds up the caller.

    Visits are evaluated after the task.
    """

    def __init__(self, geodesics: Geodesics, capacity: int = CAPACITY) -> None:
        super().__init__(geodesics, capacity)
        self._job: _Job | None = None
        self._thread: threading.Thread | None = None
        self._made: list[tuple[Label, TaskState, Visit, Plan]] = []

    def prepare(self, state: TaskState, plan: Plan) -> None:
        """Compute the first regrets, which loads the kernels."""
        self.begin(state, plan)
        self.known()
        self.wait()

    def begin(self, state: TaskState, plan: Plan) -> None:
        """As in `Regrets`; a new plan for the same state does not start over."""
        if self._task is None or not same_state(self._task[0], state):
            self.close()
        else:
            state = self._task[0]
        self._task = state, plan

    def known(self) -> Mapping[Visit, Regret]:
        """As in `Regrets`; empty until the thread has found them."""
        if self._task is None:
            return {}
        if self._job is None:
            self._job = _Job(*self._task)
            self._thread = threading.Thread(
                target=self._job.run, args=(self._geodesics, self._capacity), name="regrets", daemon=True
            )
            self._thread.start()
        return self._job.found or {}

    def wait(self) -> None:
        """Wait until what was asked last is known."""
        if self._thread is not None:
            self._thread.join()

    def evaluate(self, label: Label, visit: Visit) -> float | None:
        """None: it is left for `later`."""
        if self._task is not None:
            state, plan = self._task
            self._made.append((label, state, visit, plan))
        return None

    def later(self) -> Iterator[tuple[Label, float | None]]:
        """All visits that were asked for."""
        for label, state, visit, plan in self._made:
            yield label, self._evaluator.of(state, visit, plan)
        self._made = []

    def close(self) -> None:
        """Stop the thread."""
        if self._job is not None:
            self._job.stop.set()
        self._job = None
