"""The plans of a log, handed out as a replanner would: a replay shows what was planned then."""

from collections.abc import Callable, Sequence

from experiments.errors import ReplayError
from experiments.records import Event
from planner.plan import Plan, Status, VisitKind
from planner.route import Route, RouteVisit, TaskState


class LoggedPlans:
    """Stands in for a `planner.replanner.Replanner`.

    Args:
        plans: The log's `plan` events, in order.
        clock: Simulated time, s.

    Attributes:
        clock: As above; may be exchanged.
        replans: How often a new plan was taken up after the first.
    """

    def __init__(self, plans: Sequence[Event], clock: Callable[[], float]) -> None:
        self.clock = clock
        self.replans = 0
        self._plans = list(plans)
        self._taken = 0
        self._route: Route | None = None

    @property
    def pending(self) -> bool:
        """Whether a better plan for the same task was logged now."""
        return self._is_due and bool(self._plans[self._taken].get("improved", False))

    def poll(self, state: TaskState) -> Route | None:
        """The better plan that was logged now, if one was.

        Raises:
            ReplayError: It is no plan.
        """
        return self.update(state) if self.pending else None

    @property
    def _is_due(self) -> bool:
        return self._taken < len(self._plans) and self._plans[self._taken]["t"] <= round(self.clock(), 6)

    def update(self, state: TaskState) -> Route:
        """The plan that was logged now, if one was, else what is left of the one before.

        Raises:
            ReplayError: The log has no plan at the start, or one that is none.
        """
        if self._is_due:
            self.replans += self._route is not None and not self._plans[self._taken].get("improved", False)
            self._route = _route(self._plans[self._taken], state)
            self._taken += 1
        if self._route is None:
            raise ReplayError("the log has no plan for the start of the task; the first bad step is 0", 0)
        left = tuple(v for v in self._route.visits if _is_left(v, state))
        self._route = Route(left, self._route.cost, self._route.plan)
        return self._route


def _is_left(visit: RouteVisit, state: TaskState) -> bool:
    if visit.kind is VisitKind.PICK:
        return visit.object in state.loose
    return visit.object in state.loose or visit.object in state.carried


def _route(event: Event, state: TaskState) -> Route:
    try:
        cost = float(event["cost_m"])
        plan = Plan((), cost, float(event["lower_bound_m"]), Status(event["status"]), seconds=0.0)
        visits = []
        for kind, name in event["visits"]:
            spots = state.loose if kind == "pick" else state.deliveries
            visits.append(RouteVisit(VisitKind(kind), name, spots[name]))
        return Route(tuple(visits), cost, plan)
    except (KeyError, TypeError, ValueError) as error:
        raise ReplayError(f"the plan logged at t = {event['t']} s is none: {error!r}") from error
