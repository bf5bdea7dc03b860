"""A replanner that returns the plans of a log instead of making new ones."""

from collections.abc import Callable, Sequence

from experiments.errors import ReplayError
from experiments.runs.records import Event
from planner.plan import Plan, Status, Visit, VisitKind
from planner.route import Route, TaskState


class LoggedReplanner:
    """The plans of a log, each at the time at which it was logged.

    Args:
        plans: The `plan` events of the log, in order.
        clock: Simulated time, s.

    Attributes:
        clock: As above; may be replaced.
        replans: Number of new plans after the first, without improved ones for the same task.
    """

    def __init__(self, plans: Sequence[Event], clock: Callable[[], float]) -> None:
        self.clock = clock
        self.replans = 0
        self._plans = list(plans)
        self._route: Route | None = None

    def prepare(self, state: TaskState, *, seconds: float | None = None) -> Route:  # noqa: ARG002 - it is planned
        """The plan that was logged for the start."""
        return self.update(state)

    @property
    def pending(self) -> bool:
        """Whether a better plan for the same task was logged now."""
        return self._is_due and self._is_improved

    def poll(self, state: TaskState) -> Route | None:
        """The better plan that was logged now, or None.

        Raises:
            ReplayError: The event does not describe a plan.
        """
        return self.update(state) if self.pending else None

    def update(self, state: TaskState, *, shown: bool = True) -> Route:  # noqa: ARG002 - both are logged
        """The plan that was logged now, or the rest of the plan before.

        Raises:
            ReplayError: The log has no plan at the start, or an event does not describe a plan.
        """
        if self._is_due:
            self.replans += self._route is not None and not self._is_improved
            self._route = _route(self._plans.pop(0), state)
        if self._route is None:
            raise ReplayError("the log has no plan for the start of the task; the first bad step is 0", 0)
        rest = tuple(v for v in self._route.visits if _is_open(v, state))
        self._route = Route(rest, self._route.plan)
        return self._route

    @property
    def _is_due(self) -> bool:
        return bool(self._plans) and self._plans[0]["t"] <= round(self.clock(), 6)

    @property
    def _is_improved(self) -> bool:
        return bool(self._plans[0].get("improved", False))


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
    except (KeyError, TypeError, ValueError) as error:
        raise ReplayError(f"the plan logged at t = {event['t']} s is malformed: {error!r}") from error
