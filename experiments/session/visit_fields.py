"""What the log says about a visit: what else could have been done, and how far apart the places of visits are."""

from collections.abc import Mapping

import numpy as np

from planner.geodesics import Geodesics
from planner.plan import Visit, VisitKind
from planner.route import XY, TaskState


def as_json(visit: Visit) -> list[str]:
    """A visit as the log holds it: what is done, and with which object."""
    return [visit.kind.value, visit.object]


def alternatives(
    state: TaskState, made: Visit, suggested: Visit | None, targets: Mapping[str, str], capacity: int
) -> dict[str, int | bool]:
    """How many other visits were feasible when this one was made, and which only differ in what goes first.

    Two objects that go into the same bin are tied: it makes no difference which of them is placed first.

    Args:
        state: The task before the visit.
        made: The visit.
        suggested: What was suggested instead.
        targets: Object name -> receptacle.
        capacity: How many objects can be carried.
    """
    feasible = len(state.carried) + (len(state.loose) if len(state.carried) < capacity else 0)
    tied: set[str] = set()
    if suggested is not None and suggested.kind is VisitKind.PLACE:
        tied = {name for name in state.carried if targets[name] == targets[suggested.object]}
    return {
        "alternatives": max(feasible - 1, 0),
        "tied_alternatives": max(len(tied) - 1, 0),
        "tied": made != suggested and made.kind is VisitKind.PLACE and made.object in tied,
    }


class PlaceDistances:
    """Distances between the places of consecutive visits: where objects lay, and where one stands at a bin.

    Args:
        geodesics: Distances, as the planner measures them.
        start: Where the person is at the start, m.
    """

    def __init__(self, geodesics: Geodesics, start: XY) -> None:
        self._geodesics = geodesics
        self._last = start

    def next(self, state: TaskState, made: Visit) -> float:
        """Distance from the place of the visit before, m; `state` is the task before this visit."""
        place = state.deliveries[made.object]
        if made.kind is VisitKind.PICK:
            place = state.loose.get(made.object, state.position)
        snap = self._geodesics.navmesh.snap
        here, there = snap(np.array(self._last)), snap(np.array(place))
        self._last = place
        return float(self._geodesics.shortest_path(here, there).geodesic_distance)
