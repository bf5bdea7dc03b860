"""Worked example: find the house with the most typical tasks among many disorganized houses.

    python -m studies.examples.typical_house --houses 100

All participants of a study tidy the same house, but each house has peculiarities: objects may happen to be
near their bins, or all in one room. This script finds the house whose shortest tours with 6, 12, 18 and 24
objects are closest to the mean of all houses, by the root mean square of the standard scores. It needs no
participant.
"""

import argparse
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from rich.table import Table

from experiments.house import House
from experiments.session.assistant import deliveries
from planner.route import TaskState
from planner.solvers import solver
from planner.task_problems import TaskProblems

OBJECTS = (6, 12, 18, 24)
SHOWN = 5


def tour_lengths(houses: int) -> NDArray[np.float64]:
    """Return the lengths of the shortest tours in houses with seeds 0, 1, ..., m, shape (houses, 4)."""
    house, exact = House.load(), solver("exact")
    problems, lengths = TaskProblems(house.geodesics), np.zeros((houses, len(OBJECTS)))
    console = Console(stderr=True)
    for seed in track(range(houses), "tours", console=console, transient=True):
        for k, objects in enumerate(OBJECTS):
            episode = house.sample_episode(objects=objects, seed=seed)
            loose = {placed.name: placed.position[:2] for placed in episode.objects}
            start = (episode.start.x, episode.start.y)
            task = TaskState(start, loose, (), deliveries(house, episode))
            lengths[seed, k] = exact.solve(problems.problem(task)).cost
    return lengths


def rms_z_scores(lengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the root mean square of each house's z-scores, (n,), given tour lengths (n, 4)."""
    scores = (lengths - lengths.mean(axis=0)) / lengths.std(axis=0)
    return np.asarray(np.sqrt((scores**2).mean(axis=1)))


def main(argv: Sequence[str] | None = None) -> None:
    """Print the most typical houses and, for comparison, the first one."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--houses", type=int, default=100, metavar="N", help="house seeds 0 to N - 1 (100)")
    houses = parser.parse_args(argv).houses
    if houses < 2:
        parser.error(f"--houses {houses}: at least 2 are needed for a mean and a standard deviation")
    lengths = tour_lengths(houses)
    found = rms_z_scores(lengths)
    table = Table(title=f"Shortest tours of {houses} houses, m")
    for heading in ("house seed", *(f"{n} objects" for n in OBJECTS), "from the mean, SD"):
        table.add_column(heading, justify="right")
    for seed in dict.fromkeys([*np.argsort(found)[:SHOWN].tolist(), 0]):
        table.add_row(str(seed), *(f"{length:.1f}" for length in lengths[seed]), f"{found[seed]:.2f}")
    table.add_section()
    table.add_row("mean", *(f"{length:.1f}" for length in lengths.mean(axis=0)), "")
    Console().print(table)


if __name__ == "__main__":
    main()
