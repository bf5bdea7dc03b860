"""A planner for sessions, which runs in the caller's thread or in background threads."""

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
from planner.regret import Regret, RegretBounds, RegretEvaluator, same_state
from planner.route import PlanSource, Route, TaskState
from planner.solvers import SolveLimit

T = TypeVar("T")
REGRET_SECONDS = 5.0  # time limit for the regrets of one state in live mode, in seconds
# How long the end of a live task waits for the regrets of its visits, and then for their bounds, in seconds
FINISH_SECONDS, BOUNDS_SECONDS = 0.6, 0.9


class Mode(enum.Enum):
    """Execution modes of a planner. Each value is the maximum number of background threads."""

    INLINE = 0  # The planner runs in the caller's thread.
    THREAD = 1  # One background thread handles requests in order, with the same results as INLINE.
    LIVE = 32  # A first plan is returned immediately. Threads then compute better plans and regrets.


class Planner:
    """A planner that finds routes for a task and computes the regrets of possible visits.

    The current route is kept as long as the participant follows it and no object is moved far. Otherwise, a
    new plan is made (PAPER section 2). In the modes `INLINE` and `THREAD`, results are reproducible because
    searches are limited by work instead of time. In `LIVE` mode, the caller never waits for a proof of
    optimality, and results depend on the machine's speed.

    Args:
        source: Plan source that provides the routes.
        evaluator: Evaluator that computes the regrets.
        mode: Execution mode.

    Attributes:
        replans: Number of times that a new plan replaced a route that no longer applied.
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
        self._latest: Future[None] | None = None  # most recent job of the background thread
        self._regrets: Future[Mapping[Visit, Regret]] | None = None  # regrets of the last state, in live mode
        self._stop = threading.Event()  # set to stop the computation of regrets
        self._over = threading.Event()  # set to stop the computation of the regrets of completed visits
        live = mode is Mode.LIVE
        # One thread computes the regrets of completed visits, in the order of the visits.
        self._judges = ThreadPoolExecutor(1, "regrets") if live else None
        # Evaluators for completed visits, and for regrets that are shown. They share neither tables nor, except
        # in live mode, budgets, so logged regrets do not depend on which pictures are drawn.
        self._judge = evaluator.limited(SolveLimit(stop=self._over)) if live else evaluator
        self._display = evaluator if live else evaluator.copy()
        self._late: list[tuple[Any, Future[RegretBounds | None]]] = []  # label and regret of completed visits
        self.use(source)

    def use(self, source: PlanSource) -> None:
        """Use another plan source from now on, but keep the current route."""
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
        """Plan the route for the initial state before the task starts.

        In live mode, wait up to `seconds` for a proof of optimality, then as long for the regrets, so that their
        kernels are loaded. Both continue in the background. Raises UnreachableError or ProblemError if the task
        is impossible.
        """
        self._prepared = state
        self.do(lambda _: self._set_task(state, self._plan(state, shown=False).plan))
        if self.mode is Mode.LIVE:
            self.wait(seconds)
            self.improve(state)
            self.regrets()
            futures.wait([self._regrets] if self._regrets is not None else [], seconds)

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
            shown: True if the participant sees the plan. The plan then depends only on this state. Otherwise,
                earlier results are reused, which is several times faster but may result in a different tour
                of the same length.
            then: Callback that receives the route, and True if the plan of the route is new.

        Raises:
            UnreachableError: Some objects cannot be fetched or delivered. `names` lists them.
            ProblemError: More objects are carried than the capacity allows.
        """

        def answer(before: Route | None) -> None:
            first, self._asked = not self._asked, True
            if before is not None and first and state != self._prepared:
                before = None  # the task starts in a different state than the prepared one
            rest = None if before is None else self._source.rest(before, state)
            if before is None or rest is None:
                self.replans += not first
                route = self._plan(state, shown=shown)
            else:
                route = self._route = Route(rest, before.plan)
            self._set_task(state, route.plan)
            then(route, first or rest is None)

        if self.mode is Mode.THREAD:
            self._source.check(state)  # report an impossible task in the caller's thread
        self.do(answer)

    def do(self, job: Callable[[Route | None], None]) -> None:
        """Call a function with the current route as soon as that route is available.

        Raises PlannerError if planning failed. In thread mode, the error is raised by the next request.
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
        """Return a shorter route or the same route with a better bound, or None if nothing improved."""
        better = None if self._route is None else self._source.better(state, self._route)
        self._route = better or self._route
        return better

    def regrets(self, *, shown: bool = False) -> Mapping[Visit, Regret]:
        """Return the regrets of possible next visits, smallest first. They may be missing in live mode.

        `shown` is True for regrets that are only displayed. They have a budget of their own.
        """
        if self.route is None or self._task is None:
            return {}
        if self.mode is not Mode.LIVE:
            return (self._display if shown else self._evaluator).all(*self._task)
        if self._regrets is None:
            self._stop = threading.Event()
            self._regrets = self._start(functools.partial(self._find_regrets, *self._task, self._stop))
        return self._regrets.result() if self._regrets.done() else {}

    def regret(self, visit: Visit) -> float | None:
        """Return the exact regret of a visit in metres, or None if no exact regret is available."""
        return None if self._task is None else self._evaluator.of(self._task[0], visit, self._task[1])

    def judge(self, visit: Visit, label: Any) -> RegretBounds | None:
        """Return the regret of a completed visit, or bounds on it.

        In live mode, the result is None. A thread computes the regret, and `finish` returns it together with `label`.
        """
        if self._task is None:
            return None
        state, plan = self._task
        if self._judges is None:
            return self._judge.bounds(state, visit, plan)
        self._late.append((label, self._judges.submit(self._judge.bounds, state, visit, plan)))
        return None

    def finish(self) -> list[tuple[Any, RegretBounds | None]]:
        """End the task, and return the label and the regret of each visit that `judge` has postponed.

        After 0.6 s, regrets that are not proven yet are only bounded. Raises PlannerError if planning failed.
        """
        self.settle()
        _ = self.route
        self._forget_regrets()
        late, self._late = self._late, []
        futures.wait([found for _, found in late], FINISH_SECONDS)
        self._over.set()
        futures.wait([found for _, found in late], BOUNDS_SECONDS)
        return [(label, found.result() if found.done() else None) for label, found in late]

    def settle(self) -> None:
        """Wait for all results and switch from thread mode to inline mode. Other modes do not change."""
        if self.mode is Mode.THREAD:
            self.wait()
            self.mode = Mode.INLINE

    def wait(self, seconds: float | None = None) -> None:
        """Wait until all threads are idle, but not longer than `seconds` if this limit is given."""
        futures.wait(self._running, seconds)

    def close(self) -> None:
        """Wait for all requested routes, stop background searches, and shut down the threads."""
        self.settle()
        self._source.close()
        self._forget_regrets()
        self._over.set()
        if self._judges is not None:
            self._judges.shutdown(cancel_futures=True)
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
        """Compute the regrets of a state. Planning errors are suppressed because `ask` raises them."""
        with contextlib.suppress(PlannerError):
            found = self._evaluator.limited(SolveLimit(seconds=REGRET_SECONDS, stop=stop)).all(state, plan)
            return {} if stop.is_set() else found
        return {}
