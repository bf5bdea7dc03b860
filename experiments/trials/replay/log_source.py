"""The plans of a log as a source of routes, instead of new ones."""

from collections.abc import Callable, Sequence

from experiments.errors import ReplayError
from experiments.record.records import Event
from planner.errors import ProblemError
from planner.plan import Plan, Status, Visit, VisitKind
from planner.route import PlanSource, Route, TaskState


class LogSource(PlanSource):
    """The plans of a log, each at the time at which it was logged.

    Args:
        plans: The `plan` events of the log, in order.

    Attributes:
        clock: Gives the simulated time, s.
    """

    def __init__(self, plans: Sequence[Event], clock: Callable[[], float] = lambda: 0.0) -> None:
        self.clock = clock
        self._plans = list(plans)

    def rest(self, route: Route, state: TaskState) -> tuple[Visit, ...] | None:
        """The visits that are not done; None if a plan was logged now."""
        return None if self._is_due else tuple(v for v in route.visits if _is_open(v, state))

    def plan(self, state: TaskState, route: Route | None, *, shown: bool) -> Route:  # noqa: ARG002 - both are logged
        """The plan that was logged now.

        Raises:
            ReplayError: The log has no plan at the start, or the event does not describe a plan.
        """
        if not self._is_due:
            raise ReplayError("the log has no plan for the start of the task; the first bad step is 0", 0)
        return _route(self._plans.pop(0), state)

    @property
    def pending(self) -> bool:
        """Whether a better plan for the same task was logged now."""
        return self._is_due and bool(self._plans[0].get("improved", False))

    def better(self, state: TaskState, route: Route) -> Route | None:
        """The better plan that was logged now, or None; raises as `plan` does."""
        return self.plan(state, route, shown=True) if self.pending else None

    @property
    def _is_due(self) -> bool:
        return bool(self._plans) and self._plans[0]["t"] <= round(self.clock(), 6)


def _is_open(visit: Visit, state: TaskState) -> bool:
    if visit.kind is VisitKind.PICK:
        return visit.object in state.loose
    return visit.object in state.loose or visit.object in state.carried


def _route(event: Event, state: TaskState) -> Route:
    try:
        cost = float(event["cost_m"])
        plan = Plan((), cost, float(event["lower_bound_m"]), Status(event["status"]), seconds=0.0)
        visits = []
        for kind, name in event["visits"]:
            if name not in (state.loose if kind == "pick" else state.deliveries):
                raise ValueError(f"nothing to {kind} is called {name!r}")
            visits.append(Visit(VisitKind(kind), name))
        return Route(tuple(visits), plan)
    except (KeyError, TypeError, ValueError, ProblemError) as error:
        raise ReplayError(f"the plan logged at t = {event['t']} s is malformed: {error!r}") from error
