"""Routing problems for the planner benchmark. There are six kinds, and each is the same on every machine.

The kind "meals" contains published meal delivery problems (Grubhub, TSPPD Test Instance Library,
github.com/grubhub/tsppdlib). The file `meal_deliveries.json` contains the lower triangle of each symmetric matrix of
travel times, in seconds. The first location is the start. The others are the pickup and the delivery of each order. The
published problems do not limit the capacity; the benchmark sets it to 2. If a detour is quicker than the direct way,
the travel time of the detour is used.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.sparse.csgraph import shortest_path

from experiments.house import House
from planner.problem import RoutingProblem, Shipment
from planner.route import TaskState
from planner.task_problems import RESOLUTION, TaskProblems

SIDE = 12.0  # side of the square that contains the places of random problems, in metres
BINS = 6  # number of bins of random problems
MEALS = Path(__file__).with_name("meal_deliveries.json")
ROOMS = 6  # rooms of a generated home, so that there is space for 24 objects
# Number of problems by kind and number of objects, 500 in total
COUNTS: Mapping[str, Mapping[int, int]] = {
    "apartment": {6: 30, 12: 30, 18: 30, 24: 30, 30: 12, 40: 8},
    "mid-task": {6: 30, 12: 30, 18: 30, 24: 30, 30: 12, 40: 8},
    "home": {6: 20, 12: 20, 18: 20, 24: 20},
    "random": {12: 20, 24: 20, 30: 10, 40: 10, 60: 10},
    "many bins": {6: 10, 12: 20, 18: 10},
    "meals": {6: 10, 12: 10, 15: 10},
}


@dataclass(frozen=True, eq=False)
class Case:
    """A routing problem with its kind, its number of objects and its seed."""

    kind: str
    objects: int
    seed: int
    problem: RoutingProblem


def make_cases(counts: Mapping[str, Mapping[int, int]]) -> Iterator[Case]:
    """Yield the problems with the lowest seeds, given their numbers as in `COUNTS`."""
    houses: dict[str, tuple[House, TaskProblems]] = {}
    for kind, sizes in counts.items():
        for objects, count in sizes.items():
            for seed in range(count):
                yield Case(kind, objects, seed, _problem(kind, objects, seed, houses))


def _problem(
    kind: str, objects: int, seed: int, houses: dict[str, tuple[House, TaskProblems]]
) -> RoutingProblem:
    if kind in ("random", "many bins"):
        return random_problem(objects, BINS if kind == "random" else objects, seed)
    if kind == "meals":
        return meal_problem(objects, seed)
    name = f"generated:{seed}?rooms={ROOMS}" if kind == "home" else "apartment"
    if name not in houses:
        house = House.load(name)
        houses[name] = house, TaskProblems(house.geodesics)
    house, problems = houses[name]
    begin = first_state(house, objects, seed)
    if kind == "mid-task":
        begin = mid_task(house, begin, np.random.default_rng([objects, seed]))
    return problems.problem(begin)


def random_problem(objects: int, bins: int, seed: int) -> RoutingProblem:
    """Return a problem with random places in a square, where each bin receives about as many objects."""
    places = SIDE * np.random.default_rng([objects, bins, seed]).random((1 + bins + objects, 2))
    distances = np.linalg.norm(places[:, None] - places, axis=2)
    shipments = tuple(Shipment(1 + bins + k, 1 + k % bins) for k in range(objects))
    return RoutingProblem(distances, 0, shipments, resolution=RESOLUTION)


def meal_problem(orders: int, number: int) -> RoutingProblem:
    """Return a published meal delivery problem. Its distances are travel times in seconds."""
    triangle = json.loads(MEALS.read_text(encoding="utf-8"))[str(orders)][number]
    places = 2 * orders + 1
    times = np.zeros((places, places))
    times[np.tril_indices(places, -1)] = triangle
    shipments = tuple(Shipment(k, k + 1) for k in range(1, places, 2))
    return RoutingProblem(shortest_path(times, directed=False), 0, shipments, resolution=1.0)


def first_state(house: House, objects: int, seed: int) -> TaskState:
    episode = house.sample_episode(objects=objects, seed=seed)
    loose = {o.name: (o.position[0], o.position[1]) for o in episode.objects}
    approach = {key: r.approach for key, r in house.receptacles.items()}
    deliveries = {o: (float(approach[r][0]), float(approach[r][1])) for o, r in episode.targets.items()}
    return TaskState((episode.start.x, episode.start.y), loose, (), deliveries)


def mid_task(house: House, begin: TaskState, rng: np.random.Generator) -> TaskState:
    """Return a random state in which some objects are delivered and up to two are carried."""
    names = [str(name) for name in rng.permutation(list(begin.loose))]
    carried = int(rng.integers(0, 3))
    left = int(rng.integers(1, len(names) - carried + 1))
    at = house.navmesh.sample(rng)
    return TaskState(
        (float(at[0]), float(at[1])),
        {name: begin.loose[name] for name in names[:left]},
        tuple(names[left : left + carried]),
        begin.deliveries,
    )
