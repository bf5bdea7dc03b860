"""Differences between conditions, with intervals for homes that could as well have been others."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.analysis.statistics.anova import Values
from experiments.analysis.statistics.mixed import MIN_LEVELS
from experiments.errors import StatisticsError

RESAMPLES = 2000
TOGETHER = 100  # resamples held in memory at a time


@dataclass(frozen=True)
class HouseDifference:
    """Difference between two conditions."""

    first: str
    second: str
    difference: float  # mean of the second less that of the first; levels have equal weights
    interval: tuple[float, float]  # 95 %, by drawing houses with all their trials again


def differences_by_house(
    values: Values,
    assistance: NDArray[Any],
    objects: NDArray[np.int64],
    houses: NDArray[Any],
    conditions: Sequence[str],
    seed: int = 0,
) -> list[HouseDifference]:
    """Differences of all pairs of `conditions`; arrays have one entry per trial, (n,).

    The percentile bootstrap; `StatisticsError` with few houses, or where a cell has no trials.
    """
    names, house = np.unique(houses, return_inverse=True)
    if len(names) < MIN_LEVELS:
        raise StatisticsError(f"houses cannot be drawn again from {len(names)}; {MIN_LEVELS} are needed")
    levels = np.unique(objects)
    shape = len(names), len(conditions), len(levels)
    sums, counts = np.zeros(shape), np.zeros(shape)
    place = {condition: k for k, condition in enumerate(conditions)}
    cell = house, np.array([place[c] for c in assistance]), np.searchsorted(levels, objects)
    np.add.at(sums, cell, values)
    np.add.at(counts, cell, 1.0)
    if not counts.sum(axis=0).all():
        raise StatisticsError("a condition has no trials at some number of objects")
    rng = np.random.default_rng(seed)
    even, resampled = np.full(len(names), 1 / len(names)), []
    for _ in range(0, RESAMPLES, TOGETHER):
        drawn = rng.multinomial(len(names), even, TOGETHER)
        with np.errstate(invalid="ignore"):  # homes drawn may leave a cell empty
            resampled.append(np.tensordot(drawn, sums, 1) / np.tensordot(drawn, counts, 1))
    means, own = np.concatenate(resampled).mean(axis=2), (sums.sum(axis=0) / counts.sum(axis=0)).mean(axis=1)
    found = []
    for i, j in itertools.combinations(range(len(conditions)), 2):
        low, high = np.nanquantile(means[:, j] - means[:, i], (0.025, 0.975)).tolist()
        found.append(HouseDifference(conditions[i], conditions[j], float(own[j] - own[i]), (low, high)))
    return found
