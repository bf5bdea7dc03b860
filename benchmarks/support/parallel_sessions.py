"""Run stress sessions on several cores with a progress bar, and create their episodes."""

import functools
import math
import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

from experiments.house import House
from mjsim.values.episode import Episode, PlacedObject, StartPose

T = TypeVar("T")


def run_sessions(
    run: Callable[[House, int], T],
    count: int,
    *,
    workers: int | None = None,
    only: int | None = None,
    house: str = "apartment",
) -> list[T]:
    """Run the sessions 0 to count - 1, or only one of them. Return the results in order.

    Args:
        run: Function that runs the session with a given number. It must be picklable, and so defined in a
            module.
        count: Number of sessions.
        workers: Number of processes (default: one per core).
        only: Number of a single session to run, in order to reproduce a failure.
        house: Name of the house, or path of its catalogue.
    """
    numbers = range(count) if only is None else range(only, only + 1)
    results = _results(run, numbers, workers or os.cpu_count() or 1, house)
    return list(track(results, "sessions", total=len(numbers), console=Console(stderr=True)))


def _results(run: Callable[[House, int], T], numbers: Sequence[int], workers: int, name: str) -> Iterator[T]:
    if workers == 1 or len(numbers) < 2 * workers:
        house = House.load(name)
        yield from (run(house, number) for number in numbers)
        return
    # Processes are spawned, because thread pools do not work after a fork.
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield from pool.map(functools.partial(_run_in_worker, run, name), numbers)


def _run_in_worker(run: Callable[[House, int], T], name: str, number: int) -> T:
    return run(_house(name), number)


@functools.cache
def _house(name: str) -> House:
    return House.load(name)


def upright_object(
    house: House, number: int, model: str, xy: NDArray[np.float64], height: float, yaw: float
) -> PlacedObject:
    """Return object `o<number>` of a session, upright at a floor point (2,) and height, turned by `yaw`."""
    x, y = xy.tolist()
    quaternion = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
    category = house.catalogue.objects[model].category
    return PlacedObject(f"o{number}", category, model, (x, y), (x, y, height), quaternion)


def session_episode(
    house: House, number: int, start: NDArray[np.float64], heading: float, objects: Sequence[PlacedObject]
) -> Episode:
    """Return the episode of a session in which the person starts at a floor point (2,) with a heading."""
    catalogue = house.catalogue
    return Episode(
        house=catalogue.name,
        seed=number,
        start=StartPose(float(start[0]), float(start[1]), heading),
        objects=tuple(objects),
        receptacles=tuple(catalogue.receptacles),
        targets={o.name: catalogue.categories[o.category].receptacle for o in objects},
    )
