"""The plan of a session, kept and logged: at once, or in the background as long as nobody looks at it."""

from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

from experiments.runs.records import EventLog
from experiments.session.regrets import Regrets
from experiments.session.visit_fields import as_json
from planner.plan import Visit
from planner.replanner import Replanner
from planner.route import Route, RoutePlanner, TaskState

Fields = Mapping[str, Any] | None  # of an event; None where there is none


class Planning:
    """Plans in every condition, because deviations are counted against the plan in all of them (PAPER section 6).

    Where nobody sees the plan, it is made in a thread while the session goes on: the kernels run without the
    interpreter's lock. Log and plans are the same, because all is done in order, and who asks for the plan waits.

    Args:
        planner: Plans routes.
        regrets: Is told of every plan.
        log: Where plans are logged.
        background: Whether to plan in a thread until `stay` is called; for a `Replanner` whose plans repeat.
    """

    def __init__(
        self, planner: RoutePlanner, regrets: Regrets, log: EventLog, *, background: bool = False
    ) -> None:
        self.planner, self.regrets, self._log = planner, regrets, log
        self._route: Route | None = None
        self._error: Exception | None = None
        self._thread = ThreadPoolExecutor(1, "planning") if background else None
        self._latest: Future[Fields] | None = None

    @property
    def route(self) -> Route | None:
        """The route for the task as it is now; None before the first plan.

        Raises:
            PlannerError: There is none.
        """
        if self._latest is not None:
            self._latest.result()
            self._latest = None
        if self._error is not None:
            raise self._error
        return self._route

    @property
    def next(self) -> Visit | None:
        """The next visit; None before the first plan, or when all is done."""
        return None if self.route is None else self.route.next

    def log(self, time: float, event: str, fields: Callable[[Route | None], Fields]) -> None:
        """Log an event with fields that depend on the route that there is now, or nothing if they are None."""
        if self._thread is None:
            found = fields(self._route)
            if found is not None:
                self._log.append(time, event, **found)
            return
        self._latest = self._thread.submit(self._work_out, fields)
        self._log.append_later(time, event, self._latest)

    def update(
        self, time: float, state: TaskState, *, shown: bool, more: Callable[[Route], Mapping[str, Any]]
    ) -> None:
        """Follow the plan on, or make a new one where the task is no longer as planned, and log it.

        Args:
            time: Simulated time, s.
            state: The task as it is now.
            shown: Whether somebody sees the plan.
            more: Gives further fields of the first plan.

        Raises:
            UnreachableError: Objects that cannot be fetched or delivered; `names` lists them.
        """
        if self._thread is not None and isinstance(self.planner, Replanner):
            self.planner.problems.check(state)  # at once, so that the session ends when it happens

        def fields(route: Route | None) -> Fields:
            replans = self.planner.replans
            self._route = now = self.planner.update(state, shown=shown)
            self.regrets.begin(state, now.plan)
            if route is None:
                return {**plan_fields(now), **more(now)}
            return plan_fields(now) if self.planner.replans > replans else None

        self.log(time, "plan", fields)

    def improve(self, time: float, state: TaskState) -> bool:
        """Take up a better plan for the same task, found in the background; whether it leads elsewhere."""
        before, better = self._route, self.planner.poll(state)
        if better is None:
            return False
        self._route = better
        self._log.append(time, "plan", **plan_fields(better), improved=True)
        return before is None or better.visits != before.visits

    def stay(self) -> None:
        """From now on all is done at once."""
        if self._thread is not None:
            self._thread.shutdown()
            self._thread = self._latest = None

    def _work_out(self, fields: Callable[[Route | None], Fields]) -> Fields:
        if self._error is not None:
            return None
        try:
            return fields(self._route)
        except Exception as error:
            self._error = error
            raise


def plan_fields(route: Route) -> dict[str, Any]:
    """What the log says of a plan. Cost and bound are those of the state that it was made for."""
    return {
        "cost_m": round(route.plan.cost, 6),
        "lower_bound_m": round(route.plan.lower_bound, 6),
        "status": route.plan.status.value,
        "visits": [as_json(v) for v in route.visits],
    }
