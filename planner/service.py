"""What to do next in a task, and what the alternatives cost: at once, from a thread, or live for a person."""

import contextlib
import enum
import functools
import threading
from collections.abc import Callable, Mapping
from concurrent import futures
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, TypeVar

from planner.errors import PlannerError
from planner.plan import Plan, Visit
from planner.regret import Regret, RegretEvaluator, same_state
from planner.route import PlanSource, Route, TaskState
from planner.solvers import SolveLimit

T = TypeVar("T")
REGRET_SECONDS = 5.0  # s of wall time for the regrets of one state, live


class Mode(enum.Enum):
    """How a planner answers, and in how many threads it works at most."""

    INLINE = 0  # when it is asked
    THREAD = 1  # the same, from a thread in the order of the questions; callers wait for what they need
    LIVE = 32  # a first plan when it is asked, better plans and regrets from threads


class Planner:
    """Keeps the route of a task, and knows what alternatives to its next visit cost.

    A route is kept while what was done are its first visits and no object was pushed far; else there is a new plan
    (PAPER section 2). In the modes `INLINE` and `THREAD` answers repeat, as budgets count work. In `LIVE` the caller
    never waits for a proof, and answers depend on the machine's speed.

    Args:
        source: Where plans come from.
        evaluator: Finds regrets.
        mode: How it answers.

    Attributes:
        replans: How often a new plan was made because the route no longer fitted.
    """

    def __init__(self, source: PlanSource, evaluator: RegretEvaluator, mode: Mode = Mode.INLINE) -> None:
        self.replans = 0
        self.mode = mode
        self._evaluator = evaluator
        self._executor = None if mode is Mode.INLINE else ThreadPoolExecutor(mode.value, "planner")
        self._route: Route | None = None
        self._prepared: TaskState | None = None
        self._task: tuple[TaskState, Plan] | None = None  # the last state, and its plan
        self._asked = False
        self._running: list[Future[Any]] = []
        self._latest: Future[None] | None = None  # the last job in the thread
        self._regrets: Future[Mapping[Visit, Regret]] | None = None  # live, of that state
        self._stop = threading.Event()  # stops looking for these
        self._late: list[tuple[Any, TaskState, Visit, Plan]] = []  # visits to judge after the task
        self.use(source)

    def use(self, source: PlanSource) -> None:
        """Take plans from this source from now on; the route stays."""
        self._source = source
        source.start = self._start if self.mode is Mode.LIVE else None

    @property
    def route(self) -> Route | None:
        """The route for the last state that was asked about; None before the first.

        Raises:
            PlannerError: There is none.
        """
        if self._latest is not None:
            self._latest.result()
        return self._route

    @property
    def next(self) -> Visit | None:
        """The next visit; None before the first plan, or when everything is done."""
        route = self.route
        return None if route is None else route.next

    def prepare(self, state: TaskState, *, seconds: float | None = None) -> None:
        """Plan for the state in which the task will start.

        Args:
            state: The state.
            seconds: Live: longest wait for the proof. Then the first regrets are found, which loads the kernels.

        Raises:
            PlannerError: As `ask`.
        """
        self._prepared = state
        self.do(lambda _: self._set_task(state, self._plan(state, shown=False).plan))
        if self.mode is Mode.LIVE:
            self.wait(seconds)
            self.improve(state)
            self.regrets()
            self.wait(None)

    def ask(
        self,
        state: TaskState,
        *,
        shown: bool = True,
        then: Callable[[Route, bool], None] = lambda _route, _new: None,
    ) -> None:
        """Ask what to do next.

        Args:
            state: The task as it is now.
            shown: Whether the plan is shown. It then depends on this state alone. One that is not shown starts from
                earlier ones: several times quicker, but of equally short tours it may be another.
            then: Is called with the route, and with whether it is of a new plan.

        Raises:
            UnreachableError: Objects that cannot be fetched or delivered; `names` lists them.
            ProblemError: More is carried than the capacity allows.
        """

        def answer(before: Route | None) -> None:
            first, self._asked = not self._asked, True
            if before is not None and first and state != self._prepared:
                before = None  # prepared for another start
            rest = None if before is None else self._source.rest(before, state)
            if before is None or rest is None:
                self.replans += not first
                route = self._plan(state, shown=shown)
            else:
                route = self._route = Route(rest, before.plan)
            self._set_task(state, route.plan)
            then(route, first or rest is None)

        if self.mode is Mode.THREAD:
            self._source.check(state)  # at once, so that a session ends when it happens
        self.do(answer)

    def do(self, job: Callable[[Route | None], None]) -> None:
        """Call a function with the route for the last state that was asked about, when that is known.

        Raises:
            PlannerError: There is none; in a thread, the next question raises it.
        """
        before = self._latest

        def run() -> None:
            if before is not None:
                before.result()
            job(self._route)

        if self.mode is Mode.THREAD and not (before is not None and before.done() and before.exception()):
            self._latest = self._start(run)
        else:
            run()

    @property
    def pending(self) -> bool:
        """Whether `improve` has to be called."""
        return self._source.pending

    def improve(self, state: TaskState) -> Route | None:
        """A better route for the same task, or the same with a better bound, if one was found since; else None.

        Raises:
            PlannerError: As `ask`.
        """
        better = None if self._route is None else self._source.better(state, self._route)
        self._route = better or self._route
        return better

    def regrets(self) -> Mapping[Visit, Regret]:
        """Of all possible next visits, the best first; empty as long as they are not known."""
        if self.route is None or self._task is None:
            return {}
        if self.mode is not Mode.LIVE:
            return self._evaluator.all(*self._task)
        if self._regrets is None:
            self._stop = threading.Event()
            self._regrets = self._start(functools.partial(self._find_regrets, *self._task, self._stop))
        return self._regrets.result() if self._regrets.done() else {}

    def regret(self, visit: Visit) -> float | None:
        """Regret of one visit, m, however large; None where it is not possible or nothing is proven. May take long."""
        return None if self._task is None else self._evaluator.of(self._task[0], visit, self._task[1])

    def judge(self, visit: Visit, label: Any) -> float | None:
        """Regret of a visit that was made; live it is None, and `finish` gives it with the label."""
        if self.mode is not Mode.LIVE:
            return self.regret(visit)
        if self._task is not None:
            self._late.append((label, self._task[0], visit, self._task[1]))
        return None

    def finish(self) -> list[tuple[Any, float | None]]:
        """The task is over; returns the labels and regrets that were left for now.

        Raises:
            PlannerError: Planning failed.
        """
        self.settle()
        _ = self.route
        self._forget_regrets()
        late, self._late = self._late, []
        return [(label, self._evaluator.of(state, visit, plan)) for label, state, visit, plan in late]

    def settle(self) -> None:
        """Wait for all answers of a thread; from now on they come when they are asked for."""
        if self.mode is Mode.THREAD:
            self.wait()
            self.mode = Mode.INLINE

    def wait(self, seconds: float | None = None) -> None:
        """Wait for the threads, at most this long."""
        futures.wait(self._running, seconds)

    def close(self) -> None:
        """Wait for all answers, and stop looking for better ones."""
        self.settle()
        self._source.close()
        self._forget_regrets()
        if self._executor is not None:
            self._executor.shutdown()

    def _start(self, job: Callable[[], T]) -> "Future[T]":
        assert self._executor is not None  # noqa: S101 - for the type checker
        started = self._executor.submit(job)
        self._running = [*(future for future in self._running if not future.done()), started]
        return started

    def _plan(self, state: TaskState, *, shown: bool) -> Route:
        self._route = self._source.plan(state, self._route, shown=shown)
        return self._route

    def _set_task(self, state: TaskState, plan: Plan) -> None:
        """The task is in this state; a new plan for the same state does not start over with its regrets."""
        if self._task is not None and same_state(self._task[0], state):
            state = self._task[0]
        else:
            self._forget_regrets()
        self._task = state, plan

    def _forget_regrets(self) -> None:
        self._stop.set()
        self._regrets = None

    def _find_regrets(self, state: TaskState, plan: Plan, stop: threading.Event) -> Mapping[Visit, Regret]:
        """Those of a state, in a thread; none where it was told to stop. An impossible task is reported by `ask`."""
        with contextlib.suppress(PlannerError):
            found = self._evaluator.limited(SolveLimit(seconds=REGRET_SECONDS, stop=stop)).all(state, plan)
            return {} if stop.is_set() else found
        return {}
