"""Choose the guest's next visit or search, and determine how long the decision takes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.participants.base import Percept, Point, estimated_distances
from experiments.participants.distribution import varies
from experiments.participants.frontier import Frontier, SearchPlace
from mjsim.values.episode import CAPACITY
from planner.errors import PlannerError
from planner.plan import Visit, VisitKind


@dataclass(frozen=True)
class Decision:
    """Parameters for choosing the next visit or search.

    People plan several moves ahead, and the number of moves increases with practice (van Opheusden et al.,
    Nature 618, 2023). People's routes depend on how a building is divided into regions (Wiener and Mallot,
    Spatial Cognition and Computation 3, 2003). Planning depth, distance error and room cost are assumptions.
    """

    # temperature in metres: an option that costs c metres more has odds of exp(-c / temperature)
    temperature: float = varies({"lognormal": [0.5, 0.35]}, 0.0, 1000.0, "m")
    # planning depth: number of visits simulated ahead, rounded to an integer
    look_ahead: float = varies({"uniform": [1.5, 4.5]}, 1.0, 12.0, "visits")
    # standard deviation of the logarithm of an estimated distance
    distance_error: float = varies(0.15, 0.0, 5.0)
    # cost of entering another room in addition to the walk, in metres
    room_cost: float = varies(2.0, 0.0, 100.0, "m")
    search_cost: float = varies(3.0, 0.0, 100.0, "m")  # cost of a search in addition to the walk, in metres


@dataclass(frozen=True)
class Task:
    """The rest of the task, as far as the guest knows it. Location 0 is the guest's position."""

    legs: NDArray[np.float64]  # costs of walks between locations, in metres, shape (n, n)
    picks: Sequence[int]  # location of each object that can be picked up
    bins: Sequence[int]  # location of the bin for each object that can be picked up
    carried: Sequence[int]  # location of the bin of each carried object
    capacity: int  # maximum number of objects that can be carried


def first_step_costs(task: Task, look_ahead: int) -> list[float]:
    """Return the cost of each possible first visit in metres, first for `picks`, then for `carried`.

    The cost covers `look_ahead` visits. After the first visit, the guest imagines always choosing the nearest
    possible visit. If the hands are full, picks have an infinite cost.
    """
    picks, carried = list(range(len(task.picks))), list(task.carried)
    full = len(carried) >= task.capacity
    legs = task.legs.tolist()
    costs = []
    for k in picks:
        left = [p for p in picks if p != k]
        rest = _imagined(task, legs, task.picks[k], left, [*carried, task.bins[k]], look_ahead - 1)
        costs.append(np.inf if full else legs[0][task.picks[k]] + rest)
    for k, place in enumerate(carried):
        held = carried[:k] + carried[k + 1 :]
        costs.append(legs[0][place] + _imagined(task, legs, place, picks, held, look_ahead - 1))
    return costs


def _imagined(
    task: Task, legs: list[list[float]], at: int, picks: list[int], carried: list[int], visits: int
) -> float:
    picks, carried, cost = list(picks), list(carried), 0.0
    for _ in range(visits):
        options = [(legs[at][place], 1, place, k) for k, place in enumerate(carried)]
        if len(carried) < task.capacity:
            options += [(legs[at][task.picks[k]], 0, task.picks[k], k) for k in picks]
        if not options:
            break
        leg, is_place, at, k = min(options)
        cost += leg
        if is_place:
            del carried[k]
        else:
            picks.remove(k)
            carried.append(task.bins[k])
    return cost


def judged_distances(
    legs: NDArray[np.float64], decision: Decision, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return distances with random estimation errors, in metres."""
    return np.asarray(legs * np.exp(decision.distance_error * rng.standard_normal(legs.shape)))


def choose(costs: Sequence[float], temperature: float, rng: np.random.Generator) -> int:
    """Choose an option with a probability proportional to exp(-cost / temperature), both in metres.

    At temperature 0, choose the cheapest. An option with an infinite cost is never chosen.
    """
    noise = rng.gumbel(size=len(costs))
    return int(np.argmin(np.asarray(costs) - temperature * noise))


@dataclass(frozen=True, eq=False)
class Known:
    """The knowledge on which the guest bases a choice."""

    objects: Mapping[str, Point]  # remembered positions of objects in metres, shape (2,)
    pull: float  # weight (0 to 1) of the straight-line distance in estimated distances to these objects
    search: bool  # True if a search is possible when no known object can be fetched


class Chooser:
    """A model of how the guest chooses the next visit or search."""

    def __init__(
        self, decision: Decision, house: House, frontier: Frontier, rng: np.random.Generator
    ) -> None:
        self._decision, self._house, self._frontier, self._rng = decision, house, frontier, rng

    def choose(self, percept: Percept, known: Known) -> Visit | SearchPlace | None:
        """Return the next visit or search, or None if there is nothing to do."""
        fetchable = [] if percept.hands_full else sorted(known.objects)
        visits = [Visit(VisitKind.PICK, name) for name in fetchable]
        visits += [Visit(VisitKind.PLACE, name) for name in percept.carried]
        costs = self._visit_costs(percept, known, fetchable) if visits else []
        if known.search and not fetchable and not percept.hands_full:
            return self._or_search(percept, visits, costs)
        return visits[choose(costs, self._decision.temperature, self._rng)] if visits else None

    def _or_search(
        self, percept: Percept, visits: Sequence[Visit], costs: Sequence[float]
    ) -> Visit | SearchPlace:
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
        except PlannerError:  # at least one point is unreachable
            return np.array([estimated_distances(self._house, point, list(points)) for point in points])

    def _in_another_room(self, position: Point, rooms: Sequence[str]) -> NDArray[np.bool_]:
        here = self._house.rooms.room_at(position)
        return np.array([room != here for room in rooms])


@dataclass(frozen=True)
class Timing:
    """Parameters that determine how long reading and deciding take."""

    # factor that scales all other times: less than 1 for fast participants, more than 1 for slow ones
    pace: float = varies({"lognormal": [1.0, 0.35]}, 0.05, 20.0)
    # time to prepare the next step mentally, in seconds (Card, Moran and Newell, CACM 23, 1980)
    deciding: float = varies(1.35, 0.0, 60.0, "s")
    # reading speed in words per minute (Brysbaert, Journal of Memory and Language 109, 2019)
    reading_speed: float = varies(238.0, 10.0, 10_000.0, "words a minute")
    words: float = varies(4.0, 0.0, 100.0)  # number of words in each row of the task list
    # time in seconds to understand a suggested step and its path before walking (starting value)
    guided_step: float = varies(6.0, 0.0, 60.0, "s")
    # time in seconds to relate the flagpoles to the house before a choice (starting value)
    interpreting: float = varies({"uniform": [1.5, 3.0]}, 0.0, 60.0, "s")

    def list_time(self, rows: int) -> float:
        """Return the time in seconds to read a list with the given number of rows."""
        return self.pace * rows * self.words / self.reading_speed * 60.0

    def choice_time(self, *, poles: bool) -> float:
        """Return how long it takes to choose the next visit, in seconds. With `poles`, flagpoles have to be read."""
        return self.pace * (self.deciding + (self.interpreting if poles else 0.0))

    def suggestion_time(self) -> float:
        return self.pace * self.guided_step
