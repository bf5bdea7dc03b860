"""Many sessions in one house, on several cores, with a progress bar."""

import functools
import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import TypeVar

from rich.console import Console
from rich.progress import track

from experiments.house import House

T = TypeVar("T")


def run_sessions(run: Callable[[House, int], T], numbers: Sequence[int], *, workers: int) -> Iterator[T]:
    """Run session after session, in the order of their numbers.

    Args:
        run: Runs the session of a number; a function of a module.
        numbers: The sessions.
        workers: Processes; 1 for this one.
    """
    console = Console(stderr=True)
    yield from track(_results(run, numbers, workers), "sessions", total=len(numbers), console=console)


def _results(run: Callable[[House, int], T], numbers: Sequence[int], workers: int) -> Iterator[T]:
    if workers == 1 or len(numbers) < 2 * workers:
        house = House.load()
        yield from (run(house, number) for number in numbers)
        return
    # Spawned, not forked: a forked thread pool would not survive.
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield from pool.map(functools.partial(_in_worker, run), numbers)


def _in_worker(run: Callable[[House, int], T], number: int) -> T:
    return run(_house(), number)


@functools.cache
def _house() -> House:
    """One house per process."""
    return House.load()
