"""A plan in terms of names and positions, and the state of a task that it is made from."""

from collections.abc import Mapping
from dataclasses import dataclass

from planner.errors import ProblemError
from planner.plan import Plan, VisitKind

XY = tuple[float, float]


@dataclass(frozen=True)
class TaskState:
    """What matters of a task in progress.

    Attributes:
        position: Where the person is, m.
        loose: Where each object lies that is neither carried nor delivered, by name, m.
        carried: Names of the objects that are carried.
        deliveries: Where a person stands to deliver each loose or carried object, by name, m. Further names
            do not matter.

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
class RouteVisit:
    """One stop: pick or place an object, at a navigable position in m."""

    kind: VisitKind
    object: str
    location: XY


@dataclass(frozen=True)
class Route:
    """What is left to do, in order.

    Attributes:
        visits: Remaining stops.
        cost: Length of the open tour from the position the route was made or last updated for, m.
        plan: The plan it follows, with its bound and status. While a route is followed this stays the plan as
            it was made, done visits included.
    """

    visits: tuple[RouteVisit, ...]
    cost: float
    plan: Plan

    @property
    def next(self) -> RouteVisit | None:
        """The next stop, or None when everything is done."""
        return self.visits[0] if self.visits else None

    def follows(self, kind: VisitKind, name: str) -> bool:
        """Whether a visit is the next one of this route."""
        return self.next is not None and (self.next.kind, self.next.object) == (kind, name)
