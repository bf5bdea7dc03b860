"""The state of a task, and the route through what is left of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

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
class Route:
    """What is left to do, in order.

    Attributes:
        visits: Remaining visits.
        plan: The plan it follows, with its bound and status. While a route is followed this stays the plan as
            it was made, done visits included.
    """

    visits: tuple[Visit, ...]
    plan: Plan

    @property
    def next(self) -> Visit | None:
        """The next visit, or None when everything is done."""
        return self.visits[0] if self.visits else None


def remaining(visits: Sequence[Visit], state: TaskState) -> tuple[Visit, ...] | None:
    """The visits that are still to be done if what was done is a beginning of them, else None."""
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


class RoutePlanner(Protocol):
    """Keeps the route of a task; the replanners of `planner` do, and a replay with the logged plans."""

    @property
    def replans(self) -> int:
        """How often `update` made a new plan because the old one no longer fitted."""
        ...

    @property
    def pending(self) -> bool:
        """Whether `poll` may have a better route."""
        ...

    def prepare(self, state: TaskState, *, seconds: float | None = None) -> Route:
        """Plan the task before its clock starts, in at most so many seconds of proofs."""
        ...

    def update(self, state: TaskState, *, shown: bool = True) -> Route:
        """The route for the task as it is now; `shown` tells whether somebody sees it."""
        ...

    def poll(self, state: TaskState) -> Route | None:
        """A better route for the same task, if one was found meanwhile."""
        ...
