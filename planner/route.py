"""Task states, routes through the remaining visits, and the interface of plan sources."""

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
        position: Position of the person in metres.
        loose: Position in metres of each object that is neither carried nor delivered, by name.
        carried: Names of the carried objects.
        deliveries: Position in metres from which each loose or carried object is delivered, by name. Other
            names are ignored.

    Raises:
        ProblemError: An object is both loose and carried, is carried twice, or has no delivery position.
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
    """The remaining visits of a plan, in order."""

    visits: tuple[Visit, ...]
    plan: Plan  # the original plan, including completed visits

    @property
    def next(self) -> Visit | None:
        """The next visit, or None after the last visit."""
        return self.visits[0] if self.visits else None


def remaining(visits: Sequence[Visit], state: TaskState) -> tuple[Visit, ...] | None:
    """Return the remaining visits, or None if the current state does not match the order of the visits."""
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
    """The base class of plan sources, which provide routes to the planner."""

    # Function that runs a search in the background, or None if plans are never improved
    start: Callable[[Callable[[], None]], object] | None = None

    @abc.abstractmethod
    def rest(self, route: Route, state: TaskState) -> tuple[Visit, ...] | None:
        """Return the remaining visits of a route, or None if a new plan is needed."""

    @abc.abstractmethod
    def plan(self, state: TaskState, route: Route | None, *, shown: bool) -> Route:
        """Return a new route for a state, given the previous one. `Planner.ask` explains `shown`."""

    @property
    def pending(self) -> bool:
        """True if a background search has results that `better` has not returned yet."""
        return False

    def better(self, state: TaskState, route: Route) -> Route | None:  # noqa: ARG002 - each plan is final
        """Return a shorter route or the same route with a better bound, or None if nothing improved."""
        return None

    def close(self) -> None:  # noqa: B027 - optional
        """Stop the background search, if any."""
