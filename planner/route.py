"""The state of a task, routes through the rest of it, and the interface of plan sources."""

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
        position: Position of the person, m.
        loose: Position of each object that is neither carried nor delivered, by name, m.
        carried: Names of the carried objects.
        deliveries: Place where a person stands to deliver each loose or carried object, by name, m. May contain more
            names.

    Raises:
        ProblemError: An object is both loose and carried, is carried twice, or has no delivery.
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
    """The remaining visits in order."""

    visits: tuple[Visit, ...]
    plan: Plan  # the original plan, including visits that are done by now

    @property
    def next(self) -> Visit | None:
        """The next visit, or None if everything is done."""
        return self.visits[0] if self.visits else None


def remaining(visits: Sequence[Visit], state: TaskState) -> tuple[Visit, ...] | None:
    """Return the visits still to be done if the done ones are the first ones, else None."""
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
    """A source of routes for the planner."""

    # starts a search for better plans in the background; None if each plan is final
    start: Callable[[Callable[[], None]], object] | None = None

    @abc.abstractmethod
    def rest(self, route: Route, state: TaskState) -> tuple[Visit, ...] | None:
        """Return the remaining visits of a route, or None if another plan is due."""

    @abc.abstractmethod
    def plan(self, state: TaskState, route: Route | None, *, shown: bool) -> Route:
        """Return a new route (see `Planner.ask`). `route` is the previous one."""

    def check(self, state: TaskState) -> None:  # noqa: B027 - optional
        """Raise UnreachableError, with names, if objects cannot be fetched or delivered."""

    @property
    def pending(self) -> bool:
        """True if `better` has to be called."""
        return False

    def better(self, state: TaskState, route: Route) -> Route | None:  # noqa: ARG002 - each plan is final
        """Return a route for the same task that is better or has a better bound, or None."""
        return None

    def close(self) -> None:  # noqa: B027 - optional
        """Stop searching."""
