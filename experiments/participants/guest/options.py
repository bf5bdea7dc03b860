"""Possible next visits and searches, and their costs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.participants.base import Percept, Point
from experiments.participants.distances import estimated_distances
from experiments.participants.frontier import Frontier, Place
from experiments.participants.guest.decision import Decision, Task, choose, first_step_costs, judged_distances
from mjsim.values.episode import CAPACITY
from planner.errors import PlannerError
from planner.plan import Visit, VisitKind


@dataclass(frozen=True, eq=False)
class Known:
    """The knowledge of the task that a choice depends on."""

    objects: Mapping[str, Point]  # believed places of objects, m, shape (2,)
    pull: float  # weight of straight lines in judging distances to them, 0 to 1
    search: bool  # whether a search is possible where no known object can be fetched


class Chooser:
    """Chooses visits and searches."""

    def __init__(
        self, decision: Decision, house: House, frontier: Frontier, rng: np.random.Generator
    ) -> None:
        self._decision, self._house, self._frontier, self._rng = decision, house, frontier, rng

    def choose(self, percept: Percept, known: Known) -> Visit | Place | None:
        """The next visit or search; None if there is nothing to do."""
        fetchable = [] if percept.hands_full else sorted(known.objects)
        visits = [Visit(VisitKind.PICK, name) for name in fetchable]
        visits += [Visit(VisitKind.PLACE, name) for name in percept.carried]
        costs = self._visit_costs(percept, known, fetchable) if visits else []
        if known.search and not fetchable and not percept.hands_full:
            return self._or_search(percept, visits, costs)
        return visits[choose(costs, self._decision.temperature, self._rng)] if visits else None

    def _or_search(self, percept: Percept, visits: Sequence[Visit], costs: Sequence[float]) -> Visit | Place:
        places = self._frontier.places()
        points = [place.point for place in places]
        walks = np.array(estimated_distances(self._house, percept.position, points))
        rooms = [place.room for place in places]
        counted = walks + self._decision.room_cost * self._in_another_room(percept.position, rooms)
        best = choose(
            judged_distances(counted, self._decision, self._rng).tolist(),
            self._decision.temperature,
            self._rng,
        )
        options = [*costs, float(counted[best]) + self._decision.search_cost]
        chosen = choose(options, self._decision.temperature, self._rng)
        return visits[chosen] if chosen < len(visits) else places[best]

    def _visit_costs(self, percept: Percept, known: Known, fetchable: Sequence[str]) -> list[float]:
        """Costs of visits, m: of objects that can be fetched, then of carried ones."""
        names = [*fetchable, *percept.carried]
        bins = sorted({percept.targets[name] for name in names})
        places = [percept.position, *(known.objects[n] for n in fetchable)]
        places += [self._house.approaches[key] for key in bins]
        place_of_bin = {key: 1 + len(fetchable) + k for k, key in enumerate(bins)}
        task = Task(
            legs=self._judged_legs(places, known.pull, len(fetchable)),
            picks=range(1, 1 + len(fetchable)),
            bins=[place_of_bin[percept.targets[name]] for name in fetchable],
            carried=[place_of_bin[percept.targets[name]] for name in percept.carried],
            capacity=CAPACITY if not percept.hands_full else len(percept.carried),
        )
        return first_step_costs(task, round(self._decision.look_ahead))

    def _judged_legs(self, places: Sequence[Point], pull: float, objects: int) -> NDArray[np.float64]:
        """Costs of walks between places, m, shape (n, n); the first `objects` after the start show through walls."""
        points = np.array(places)
        legs = self._all_legs(points)
        straight = np.linalg.norm(points[:, None] - points[None], axis=2)
        to_poles = slice(1, 1 + objects)
        legs[:, to_poles] = (1 - pull) * legs[:, to_poles] + pull * straight[:, to_poles]
        rooms = np.array([self._house.rooms.room_at(point) for point in points])
        crossing = rooms[:, None] != rooms[None]
        counted = judged_distances(legs, self._decision, self._rng) + self._decision.room_cost * crossing
        return np.asarray(counted)

    def _all_legs(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        try:
            return self._house.geodesics.distances(points)
        except PlannerError:  # one of them cannot be reached
            return np.array([estimated_distances(self._house, point, list(points)) for point in points])

    def _in_another_room(self, position: Point, rooms: Sequence[str]) -> NDArray[np.bool_]:
        here = self._house.rooms.room_at(position)
        return np.array([room != here for room in rooms])
