"""The planner of a session, which runs in the caller's thread, in a background thread, or live in several threads."""

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
REGRET_SECONDS = 5.0  # maximum wall time for the regrets of one state in live mode, in seconds


class Mode(enum.Enum):
    """Execution mode of a planner. The value is the maximum number of threads."""

    INLINE = 0  # plans in the caller's thread
    THREAD = 1  # gives the same results from one background thread, in order
    LIVE = 32  # returns a first plan immediately, and computes better plans and regrets in threads


class Planner:
    """Plans the route of a task and computes the regrets of its alternatives.

    A route is kept while the participant follows it and no object is pushed far. Otherwise a new plan is made (PAPER
    section 2). In the modes `INLINE` and `THREAD`, results are reproducible because search budgets count work instead
    of time. In `LIVE` mode, the caller never waits for a proof of optimality, and results depend on the machine's
    speed.

    Args:
        source: Source of the plans.
        evaluator: Evaluator that computes the regrets.
        mode: Execution mode.

    Attributes:
        replans: Number of new plans made because the route no longer fitted.
    """

    def __init__(self, source: PlanSource, evaluator: RegretEvaluator, mode: Mode = Mode.INLINE) -> None:
        self.replans = 0
        self.mode = mode
        self._evaluator = evaluator
        self._executor = None if mode is Mode.INLINE else ThreadPoolExecutor(mode.value, "planner")
        self._route: Route | None = None
        self._prepared: TaskState | None = None
        self._task: tuple[TaskState, Plan] | None = None  # last requested state and its plan
        self._asked = False
        self._running: list[Future[Any]] = []
        self._latest: Future[None] | None = None  # last job submitted to the thread
        self._regrets: Future[Mapping[Visit, Regret]] | None = None  # regrets of the last state, in live mode
        self._stop = threading.Event()  # set to stop the search for these regrets
        # visits whose regrets are computed after the task
        self._late: list[tuple[Any, TaskState, Visit, Plan]] = []
        self.use(source)

    def use(self, source: PlanSource) -> None:
        """Switch to another source of plans. The current route is kept."""
        self._source = source
        source.start = self._start if self.mode is Mode.LIVE else None

    @property
    def route(self) -> Route | None:
        """The route for the last requested state, or None before the first request.

        Raises PlannerError if planning failed.
        """
        if self._latest is not None:
            self._latest.result()
        return self._route

    @property
    def next(self) -> Visit | None:
        """The next visit, or None before the first plan and after the last visit."""
        route = self.route
        return None if route is None else route.next

    def prepare(self, state: TaskState, *, seconds: float | None = None) -> None:
        """Plan in advance for the state in which the task will start.

        In live mode, wait up to `seconds` for the proof, then compute regrets once to load their kernels. Raises
        UnreachableError or ProblemError if the task is impossible.
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
        """Request a route for the current state of the task.

        Args:
            state: Current state of the task.
            shown: True if the plan is shown to the participant. It then depends only on this state. A plan that is not
                shown reuses earlier results, which is several times faster but may select another of several equally
                short tours.
            then: Function called with the route, and with True if the route has a new plan.

        Raises:
            UnreachableError: Some objects cannot be fetched or delivered. `names` lists them.
            ProblemError: More objects are carried than the capacity allows.
        """

        def answer(before: Route | None) -> None:
            first, self._asked = not self._asked, True
            if before is not None and first and state != self._prepared:
                before = None  # the task starts in another state than the prepared one
            rest = None if before is None else self._source.rest(before, state)
            if before is None or rest is None:
                self.replans += not first
                route = self._plan(state, shown=shown)
            else:
                route = self._route = Route(rest, before.plan)
            self._set_task(state, route.plan)
            then(route, first or rest is None)

        if self.mode is Mode.THREAD:
            self._source.check(state)  # an impossible task fails here, in the caller's thread
        self.do(answer)

    def do(self, job: Callable[[Route | None], None]) -> None:
        """Call a function with the route for the last requested state, as soon as that route is available.

        Raises PlannerError if planning failed. In thread mode, the next request raises the error.
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
        """True if a background search has results that `improve` has not returned yet."""
        return self._source.pending

    def improve(self, state: TaskState) -> Route | None:
        """Return a shorter route for the same task, or the same route with a better bound, or None."""
        better = None if self._route is None else self._source.better(state, self._route)
        self._route = better or self._route
        return better

    def regrets(self) -> Mapping[Visit, Regret]:
        """Return the regrets of all possible next visits, smallest first. In live mode, the result may be empty."""
        if self.route is None or self._task is None:
            return {}
        if self.mode is not Mode.LIVE:
            return self._evaluator.all(*self._task)
        if self._regrets is None:
            self._stop = threading.Event()
            self._regrets = self._start(functools.partial(self._find_regrets, *self._task, self._stop))
        return self._regrets.result() if self._regrets.done() else {}

    def regret(self, visit: Visit) -> float | None:
        """Return the exact regret of a visit in metres, or None if it is impossible or unproven."""
        return None if self._task is None else self._evaluator.of(self._task[0], visit, self._task[1])

    def judge(self, visit: Visit, label: Any) -> float | None:
        """Return the regret of a completed visit in metres.

        In live mode, return None. `finish` then returns the regret together with `label`.
        """
        if self.mode is not Mode.LIVE:
            return self.regret(visit)
        if self._task is not None:
            self._late.append((label, self._task[0], visit, self._task[1]))
        return None

    def finish(self) -> list[tuple[Any, float | None]]:
        """End the task. Return the label and regret of each visit that `judge` postponed.

        Raises PlannerError if planning failed.
        """
        self.settle()
        _ = self.route
        self._forget_regrets()
        late, self._late = self._late, []
        return [(label, self._evaluator.of(state, visit, plan)) for label, state, visit, plan in late]

    def settle(self) -> None:
        """In thread mode, wait for all results and switch to inline mode."""
        if self.mode is Mode.THREAD:
            self.wait()
            self.mode = Mode.INLINE

    def wait(self, seconds: float | None = None) -> None:
        """Wait until all threads are idle, or for at most `seconds` if given."""
        futures.wait(self._running, seconds)

    def close(self) -> None:
        """Wait for all requested routes, stop background searches, and shut down the threads."""
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
        if self._task is not None and same_state(self._task[0], state):
            state = self._task[0]
        else:
            self._forget_regrets()
        self._task = state, plan

    def _forget_regrets(self) -> None:
        self._stop.set()
        self._regrets = None

    def _find_regrets(self, state: TaskState, plan: Plan, stop: threading.Event) -> Mapping[Visit, Regret]:
        """Compute the regrets of a state. Planning errors are ignored, because `ask` raises them."""
        with contextlib.suppress(PlannerError):
            found = self._evaluator.limited(SolveLimit(seconds=REGRET_SECONDS, stop=stop)).all(state, plan)
            return {} if stop.is_set() else found
        return {}
