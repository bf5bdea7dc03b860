"""The state of a task, the route through what is left of it, and where routes come from."""

import abc
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from planner.errors import ProblemError
from planner.plan import Plan, Visit, VisitKind

XY = tuple[float, float]


@dataclass(frozen=True)
class TaskState:
    """The state of a task in progress.

    Attributes:
        position: Where the person is, m.
        loose: Where each object lies that is neither carried nor delivered, by name, m.
        carried: Names of the objects that are carried.
        deliveries: Where a person stands to deliver each loose or carried object, by name, m; may hold more names.

    Raises:
        ProblemError: An object is both loose and carried, carried twice, or has no delivery.
    """

    position: XY
    loose: Mapping[str, XY]
    carried: tuple[str, ...]
    deliveries: Mapping[str, XY]

    def __post_init__(self) -> None:
        both = sorted(set(self.loose) & set(self.carried))
        if both:
            raise ProblemError(f"{both} are both loose and carried; an object must be in one place")
        if len(set(self.carried)) != len(self.carried):
            raise ProblemError(f"an object is carried twice in {list(self.carried)}")
        homeless = sorted((set(self.loose) | set(self.carried)) - set(self.deliveries))
        if homeless:
            raise ProblemError(f"no delivery position for {homeless}; add them to deliveries")


@dataclass(frozen=True)
class Route:
    """The visits that are left, in order."""

    visits: tuple[Visit, ...]  # remaining visits
    plan: Plan  # the plan as it was made, visits included that are done by now

    @property
    def next(self) -> Visit | None:
        """The next visit, or None when everything is done."""
        return self.visits[0] if self.visits else None


def remaining(visits: Sequence[Visit], state: TaskState) -> tuple[Visit, ...] | None:
    """The visits that are still to be done if those done are the first ones, else None."""
    loose = {visit.object for visit in visits if visit.kind is VisitKind.PICK}
    carried = {visit.object for visit in visits} - loose
    done = 0
    while (loose, carried) != (set(state.loose), set(state.carried)):
        if done == len(visits):
            return None
        kind, name = visits[done]
        done += 1
        if kind is VisitKind.PICK:
            loose.remove(name)
            carried.add(name)
        else:
            carried.remove(name)
    return tuple(visits[done:])


class PlanSource(abc.ABC):
    """Gives the planner its routes."""

    # runs a search for better plans in the background; None where each plan is final
    start: Callable[[Callable[[], None]], object] | None = None

    @abc.abstractmethod
    def rest(self, route: Route, state: TaskState) -> tuple[Visit, ...] | None:
        """The visits that are left of a route, or None if another plan is due."""

    @abc.abstractmethod
    def plan(self, state: TaskState, route: Route | None, *, shown: bool) -> Route:
        """A new route; see `Planner.ask`. `route` is the one before."""

    def check(self, state: TaskState) -> None:  # noqa: B027 - a source may have nothing to check
        """Raise UnreachableError if an object cannot be fetched or delivered; `names` lists them."""

    @property
    def pending(self) -> bool:
        """Whether `better` has to be called."""
        return False

    def better(self, state: TaskState, route: Route) -> Route | None:  # noqa: ARG002 - each plan is final
        """A better route for the same task than the present one, or the same with a better bound, if there is one."""
        return None

    def close(self) -> None:  # noqa: B027 - a source may have nothing to stop
        """Stop searching."""
