"""What alternatives to the plan cost: worked out at once in runs that repeat, in a thread beside a person."""

import contextlib
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from planner.errors import PlannerError
from planner.geodesics import Geodesics
from planner.plan import Plan, Visit
from planner.regret import Regret
from planner.regret_evaluator import RegretEvaluator, same_state
from planner.route import TaskState
from planner.solver import SolveLimit

PATIENCE = 5.0  # s of wall time for the regrets of one state, beside a person


class Regrets(Protocol):
    """Regrets of the possible next visits in the present state of a task.

    The state is the one after the last visit or mishap, where the plan was last made or followed: from there on the
    person goes where they choose.
    """

    def prepare(self, state: TaskState, plan: Plan) -> None:
        """What takes long is done before the clock starts."""

    def begin(self, state: TaskState, plan: Plan) -> None:
        """The task is in this state from now on; `plan` is what was planned for it or before."""

    def known(self) -> Mapping[Visit, Regret]:
        """Of all possible next visits, the best first; empty as long as nothing is known."""

    def exact(self, visit: Visit) -> float | None:
        """Regret of one visit, m, also where `known` only has a bound; None where nothing is proven. May take long."""

    def evaluate(self, number: int, visit: Visit) -> float | None:
        """As `exact`, of a visit that is made now, or None if that comes from `later`; `number` counts the visits."""

    def later(self) -> Iterator[tuple[int, float | None]]:
        """After the task: numbers and exact regrets of visits that were not known in time."""

    def close(self) -> None:
        """Stop what goes on behind the scenes."""


class RegretsAtOnce:
    """Works out what is asked when it is asked. Budgets count work, so the answers repeat."""

    def __init__(self, geodesics: Geodesics) -> None:
        self._evaluator = RegretEvaluator(geodesics)
        self._state: TaskState | None = None
        self._plan: Plan | None = None

    def prepare(self, state: TaskState, plan: Plan) -> None:
        """Nothing takes long here but the answers."""

    def begin(self, state: TaskState, plan: Plan) -> None:
        """See :class:`Regrets`."""
        self._state, self._plan = state, plan

    def known(self) -> Mapping[Visit, Regret]:
        """See :class:`Regrets`."""
        return {} if self._state is None else self._evaluator.all(self._state, self._plan)

    def exact(self, visit: Visit) -> float | None:
        """See :class:`Regrets`."""
        return None if self._state is None else self._evaluator.of(self._state, visit, self._plan)

    def evaluate(self, number: int, visit: Visit) -> float | None:  # noqa: ARG002 - nothing is left for later
        """See :class:`Regrets`."""
        return self.exact(visit)

    def later(self) -> Iterator[tuple[int, float | None]]:
        """Nothing: every visit was evaluated when it was made."""
        return iter(())

    def close(self) -> None:
        """Nothing goes on."""


@dataclass(eq=False)
class _Job:
    """The regrets of one state, being worked out in a thread."""

    state: TaskState
    plan: Plan
    stop: threading.Event = field(default_factory=threading.Event)
    found: Mapping[Visit, Regret] | None = None

    def run(self, geodesics: Geodesics) -> None:
        """Find them, unless told to stop; the planner itself tells of a task that cannot be done."""
        limit = SolveLimit(seconds=PATIENCE, stop=self.stop)
        with contextlib.suppress(PlannerError):
            found = RegretEvaluator(geodesics, limit=limit).all(self.state, self.plan)
            self.found = None if self.stop.is_set() else found


class RegretsBeside:
    """Works out what is `known` in a thread, from the first question about a state on; the caller never waits for it.

    Visits are evaluated after the task.
    """

    def __init__(self, geodesics: Geodesics) -> None:
        self._geodesics = geodesics
        self._evaluator = RegretEvaluator(geodesics)
        self._job: _Job | None = None
        self._thread: threading.Thread | None = None
        self._state: TaskState | None = None
        self._plan: Plan | None = None
        self._made: list[tuple[int, TaskState, Visit, Plan]] = []

    def prepare(self, state: TaskState, plan: Plan) -> None:
        """Work out the first regrets: that loads the kernels."""
        self.begin(state, plan)
        self.known()
        self.wait()

    def begin(self, state: TaskState, plan: Plan) -> None:
        """See :class:`Regrets`."""
        if self._state is not None and same_state(self._state, state):
            self._plan = plan
            return
        self.close()
        self._state, self._plan = state, plan

    def known(self) -> Mapping[Visit, Regret]:
        """See :class:`Regrets`."""
        if self._state is None or self._plan is None:
            return {}
        if self._job is None:
            self._job = _Job(self._state, self._plan)
            self._thread = threading.Thread(
                target=self._job.run, args=(self._geodesics,), name="regrets", daemon=True
            )
            self._thread.start()
        return self._job.found or {}

    def wait(self) -> None:
        """Wait until what was asked last is known."""
        if self._thread is not None:
            self._thread.join()

    def exact(self, visit: Visit) -> float | None:
        """See :class:`Regrets`."""
        return None if self._state is None else self._evaluator.of(self._state, visit, self._plan)

    def evaluate(self, number: int, visit: Visit) -> float | None:
        """None: it is left for `later`."""
        if self._state is not None and self._plan is not None:
            self._made.append((number, self._state, visit, self._plan))
        return None

    def later(self) -> Iterator[tuple[int, float | None]]:
        """See :class:`Regrets`."""
        for number, state, visit, plan in self._made:
            yield number, self._evaluator.of(state, visit, plan)
        self._made = []

    def close(self) -> None:
        """See :class:`Regrets`."""
        if self._job is not None:
            self._job.stop.set()
        self._job = None
