"""A planner for sessions. It runs in the caller's thread, and in live sessions also in background threads."""

import contextlib
import functools
import threading
from collections.abc import Callable, Mapping
from concurrent import futures
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from typing import Any, TypeVar

from planner.errors import PlannerError
from planner.plan import Plan, Visit
from planner.regret import Regret, RegretBounds, RegretEvaluator, same_state
from planner.route import PlanSource, Route, TaskState
from planner.solvers import SolveLimit

T = TypeVar("T")
MAX_THREADS = 32  # maximum number of background threads of a live planner
REGRET_SECONDS = 5.0  # time limit for the regrets of one state in live mode, in seconds
# How long the end of a live task waits for the regrets of its visits, and then for their bounds, in seconds
FINISH_SECONDS, BOUNDS_SECONDS = 0.6, 0.9


class Planner:
    """A planner that finds routes for a task and computes the regrets of possible visits.

    The current route is kept as long as the participant follows it and no object is moved far. Otherwise, a
    new plan is made (PAPER section 2). Results are reproducible, because searches are limited by work instead of
    time. A live planner returns a first plan immediately, and threads then compute better plans and regrets. Its
    caller never waits for a proof of optimality, and its results depend on the machine's speed.

    Args:
        source: Plan source that provides the routes.
        evaluator: Evaluator that computes the regrets.
        live: True for a live planner.

    Attributes:
        route: The route for the last requested state, or None before the first request.
        replans: Number of times that a new plan replaced a route that no longer applied.
    """

    def __init__(self, source: PlanSource, evaluator: RegretEvaluator, *, live: bool = False) -> None:
        self.route: Route | None = None
        self.replans = 0
        self._live = live
        self._evaluator = evaluator
        self._executor = ThreadPoolExecutor(MAX_THREADS, "planner") if live else None
        self._prepared: TaskState | None = None
        self._task: tuple[TaskState, Plan] | None = None  # last requested state and its plan
        self._asked = False
        self._running: list[Future[Any]] = []
        self._regrets: Future[Mapping[Visit, Regret]] | None = None  # regrets of the last state, if live
        self._stop = threading.Event()  # stops the computation of the last state's regrets
        self._over = threading.Event()  # stops the computation of completed visits' regrets
        # One thread computes the regrets of completed visits, in the order of the visits.
        self._judges = ThreadPoolExecutor(1, "regrets") if live else None
        # Evaluators for completed visits, and for regrets that are shown. They share neither tables nor, unless
        # the planner is live, budgets, so logged regrets do not depend on which pictures are drawn.
        self._judge = evaluator.limited(SolveLimit(stop=self._over)) if live else evaluator
        self._display = evaluator if live else replace(evaluator, search=None)
        self._late: list[tuple[Any, Future[RegretBounds | None]]] = []  # label and regret of completed visits
        self.use(source)

    def use(self, source: PlanSource) -> None:
        """Use another plan source from now on, but keep the current route."""
        self._source = source
        source.start = self._start if self._live else None

    @property
    def next(self) -> Visit | None:
        """The next visit, or None before the first plan and after the last visit."""
        return None if self.route is None else self.route.next

    def prepare(self, state: TaskState, *, seconds: float | None = None) -> None:
        """Plan the route for the initial state before the task starts.

        If live, wait up to `seconds` for a proof of optimality, then as long for the regrets, so that their kernels are
        loaded. Both continue in the background. Raises UnreachableError or ProblemError if the task is impossible.
        """
        self._prepared = state
        self._plan(state, shown=False)
        if self._live:
            self.wait(seconds)
            self.improve(state)
            self.regrets()
            futures.wait([self._regrets] if self._regrets is not None else [], seconds)

    def ask(self, state: TaskState, *, shown: bool = True) -> bool:
        """Update the route for the current state of the task. Return True if a new plan was made.

        Args:
            state: Current state of the task.
            shown: True if the participant sees the plan. The plan then depends only on this state. Otherwise,
                earlier results are reused, which is several times faster but may result in a different tour
                of the same length.

        Raises:
            UnreachableError: Some objects cannot be fetched or delivered. `names` lists them.
            ProblemError: More objects are carried than the capacity allows.
        """
        before, first, self._asked = self.route, not self._asked, True
        if before is not None and first and state != self._prepared:
            before = None  # the task starts in a different state than the prepared one
        rest = None if before is None else self._source.rest(before, state)
        if before is None or rest is None:
            self.replans += not first
            self._plan(state, shown=shown)
        else:
            self.route = Route(rest, before.plan)
            self._set_task(state, before.plan)
        return first or rest is None

    @property
    def pending(self) -> bool:
        """True if a background search has results that `improve` has not returned yet."""
        return self._source.pending

    def improve(self, state: TaskState) -> Route | None:
        """Return a shorter route or the same route with a better bound, or None if nothing improved."""
        better = None if self.route is None else self._source.better(state, self.route)
        self.route = better or self.route
        return better

    def regrets(self, *, shown: bool = False) -> Mapping[Visit, Regret]:
        """Return the regrets of possible next visits, smallest first. They may be missing if the planner is live.

        `shown` is True for regrets that are only displayed. They have a budget of their own.
        """
        if self.route is None or self._task is None:
            return {}
        if not self._live:
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

        If live, the result is None. A thread computes the regret, and `finish` returns it together with `label`.
        """
        if self._task is None:
            return None
        state, plan = self._task
        if self._judges is None:
            return self._judge.bounds(state, visit, plan)
        self._late.append((label, self._judges.submit(self._judge.bounds, state, visit, plan)))
        return None

    def finish(self) -> list[tuple[Any, RegretBounds | None]]:
        """End the task, and return the label and the regret of each visit whose regret `judge` has postponed.

        After 0.6 s, regrets that are not proven yet are only bounded. Raises PlannerError if planning failed.
        """
        self._forget_regrets()
        late, self._late = self._late, []
        futures.wait([found for _, found in late], FINISH_SECONDS)
        self._over.set()
        futures.wait([found for _, found in late], BOUNDS_SECONDS)
        return [(label, found.result() if found.done() else None) for label, found in late]

    def wait(self, seconds: float | None = None) -> None:
        """Wait until all threads are idle, but not longer than `seconds` if this limit is given."""
        futures.wait(self._running, seconds)

    def close(self) -> None:
        """Stop background searches, and shut down the threads."""
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

    def _plan(self, state: TaskState, *, shown: bool) -> None:
        self.route = self._source.plan(state, self.route, shown=shown)
        self._set_task(state, self.route.plan)

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
