"""Create routing problems for the states of a task, with positions snapped to the navmesh."""

import math

import numpy as np
from numpy.typing import NDArray

from planner.errors import NotNavigableError, UnreachableError
from planner.geodesics import Geodesics
from planner.plan import Visit, VisitKind
from planner.problem import RoutingProblem, Shipment
from planner.route import XY, TaskState

RESOLUTION = 1e-4  # precision of geodesic distances, in metres


class TaskProblems:
    """A factory of routing problems for successive states of a task, with a cache of distances."""

    def __init__(self, geodesics: Geodesics, capacity: int = 2) -> None:
        self._geodesics = geodesics
        self._capacity = capacity
        self._snapped: dict[XY, XY] = {}  # nearest navigable point of each position
        self._row: dict[XY, int] = {}  # row of each place in `_distances`
        self._distances: NDArray[np.float64] = np.zeros((0, 0))

    def problem(self, state: TaskState) -> RoutingProblem:
        """Return the routing problem of a state. Loose objects come first, followed by carried objects.

        Raises UnreachableError if objects cannot be fetched or delivered, and ProblemError if more objects are carried
        than the capacity allows.
        """
        at = self._places(state)
        places = list(dict.fromkeys(at.values()))
        index = {place: k + 1 for k, place in enumerate(places)}
        distances = np.zeros((len(places) + 1, len(places) + 1))
        distances[1:, 1:] = self._between(places)
        if places:
            here = self._snap(state.position)
            distances[0, 1:] = distances[1:, 0] = self._geodesics.distances_between([here], places)[0]
        return RoutingProblem(
            distances,
            0,
            tuple(
                Shipment(index[at[Visit(VisitKind.PICK, name)]], index[at[Visit(VisitKind.PLACE, name)]])
                for name in state.loose
            ),
            tuple(index[at[Visit(VisitKind.PLACE, name)]] for name in state.carried),
            self._capacity,
            (*state.loose, *state.carried),
            RESOLUTION,
        )

    def _snap(self, position: XY, max_distance: float = math.inf) -> XY:
        x, y = self._geodesics.navmesh.snap(position, max_distance)
        return float(x), float(y)

    def _places(self, state: TaskState) -> dict[Visit, XY]:
        wanted = {Visit(VisitKind.PICK, name): at for name, at in state.loose.items()}
        for name in (*state.loose, *state.carried):
            wanted[Visit(VisitKind.PLACE, name)] = state.deliveries[name]
        places, faults = {}, {}
        for visit, at in wanted.items():
            try:
                if at not in self._snapped:
                    self._snapped[at] = self._snap(at, self._geodesics.max_snap)
                places[visit] = self._snapped[at]
            except NotNavigableError as error:
                faults[visit.object] = f"{visit.object} ({visit.kind.value}: {error})"
        if faults:
            raise UnreachableError(
                f"out of reach from where people walk: {'; '.join(faults.values())}; move them", tuple(faults)
            )
        return places

    def _between(self, places: list[XY]) -> NDArray[np.float64]:
        old = [p for p in places if p in self._row]
        new = [p for p in places if p not in self._row]
        order = {p: k for k, p in enumerate([*old, *new])}
        rows = [self._row[p] for p in old]
        result = np.zeros((len(order), len(order)))
        result[: len(old), : len(old)] = self._distances[np.ix_(rows, rows)]
        if new:
            fresh = self._geodesics.distances_between(new, [*old, *new])
            square = fresh[:, len(old) :]
            result[len(old) :, : len(old)] = fresh[:, : len(old)]
            result[: len(old), len(old) :] = fresh[:, : len(old)].T
            result[len(old) :, len(old) :] = np.minimum(square, square.T) * (1 - np.eye(len(new)))
        self._row, self._distances = order, result
        wanted = [order[p] for p in places]
        return result[np.ix_(wanted, wanted)]
