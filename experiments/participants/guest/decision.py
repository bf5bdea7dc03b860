"""The choice of the next visit: noisy, with a look a few visits ahead."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.participants.behaviour import varies


@dataclass(frozen=True)
class Decision:
    """How a person chooses.

    People plan several moves ahead, the more the better they know a task (van Opheusden et al., Nature 618, 2023),
    and regions of a building enter their routes (Wiener and Mallot, Spatial Cognition and Computation 3, 2003). The
    number of moves, the error of distances and the cost of a region are assumptions.
    """

    # of the choice: an option that costs c metres more is taken with odds exp(-c / temperature), m
    temperature: float = varies({"lognormal": [0.5, 0.35]}, 0.0, 1000.0, "m")
    # how many visits are imagined, the nearest one next each time; rounded
    look_ahead: float = varies({"uniform": [1.5, 4.5]}, 1.0, 12.0, "visits")
    # standard deviation of the logarithm of a distance as it is judged
    distance_error: float = varies(0.15, 0.0, 5.0)
    # cost of entering another room in addition to the walk, m
    room_cost: float = varies(2.0, 0.0, 100.0, "m")
    search_cost: float = varies(3.0, 0.0, 100.0, "m")  # cost of a search in addition to the walk, m


@dataclass(frozen=True)
class Task:
    """The known rest of the task, by numbers of places."""

    legs: NDArray[np.float64]  # costs of walks from place to place, m, shape (n, n); place 0 is the person's
    picks: Sequence[int]  # place of each object that can be fetched
    bins: Sequence[int]  # place of the bin of each of these
    carried: Sequence[int]  # place of the bin of each object in the hands
    capacity: int  # how many objects are carried at most


def first_step_costs(task: Task, look_ahead: int) -> list[float]:
    """Cost of the next `look_ahead` visits, m, for each possible first one: those of `picks`, then of `carried`.

    After the first, the nearest possible visit is imagined each time. With both hands full, picks are infinite.
    """
    picks, carried, full = (
        list(range(len(task.picks))),
        list(task.carried),
        len(task.carried) >= task.capacity,
    )
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
    """Cost of some visits, each the nearest possible one, m."""
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
    """Distances as a person judges them, m; any shape."""
    return np.asarray(legs * np.exp(decision.distance_error * rng.standard_normal(legs.shape)))


def choose(costs: Sequence[float], temperature: float, rng: np.random.Generator) -> int:
    """Number of an option, with odds exp(-cost / temperature), m; the cheapest at 0, never one of infinite cost."""
    noise = rng.gumbel(size=len(costs))
    return int(np.argmin(np.asarray(costs) - temperature * noise))
