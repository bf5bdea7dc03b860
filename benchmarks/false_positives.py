"""Studies of the published sizes without any effect: how often does each test find one? 5 +- 1 % is right."""

import itertools
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f

from experiments.analysis.published import read_published
from experiments.analysis.statistics.anova import (
    brown_forsythe,
    one_way_statistic,
    two_way_statistics,
    welch,
)
from experiments.analysis.statistics.effects import ALPHA
from experiments.analysis.statistics.pairs import tukey_differs

COUNT = 10_000  # studies; a rate is then known to 0.22 %
QUICK_COUNT = 500
OBJECTS = 6  # of the tests of one factor
BAND = (0.04, 0.06)
EFFECTS = ("assistance", "objects", "interaction")


def measure(*, count: int = 0, quick: bool = False) -> dict[str, Any]:
    """Run the benchmark; everything in it can be written as JSON.

    Args:
        count: Studies; 0 for 10,000, or 500 when `quick`.
        quick: Few studies.
    """
    studies = count or (QUICK_COUNT if quick else COUNT)
    sizes = read_published().people.sizes()
    cells = [cell for cell, people in sizes.items() for _ in range(people)]
    first, second = np.array([c for c, _ in cells]), np.array([n for _, n in cells])
    rng, found = np.random.default_rng(0), Counter[str]()
    for _ in range(studies):
        found.update(findings(rng.normal(size=len(cells)), first, second, kinds=(2, 3)))
    return {"studies": studies, "rates": {name: hits / studies for name, hits in found.items()}}


def findings(
    values: NDArray[np.float64], first: NDArray[Any], second: NDArray[np.int64], kinds: Sequence[int] = (2,)
) -> dict[str, int]:
    """Whether tests find an effect, 0 or 1, by name.

    Args:
        values: One per person, (n,).
        first: Condition of each, (n,).
        second: Number of objects of each, (n,).
        kinds: Types of the tests of two factors.
    """
    here = second == OBJECTS
    groups = {name: values[here & (first == name)] for name in dict.fromkeys(first.tolist())}
    found = {
        "one factor, Fisher": f.sf(*one_way_statistic(groups)) < ALPHA,
        "one factor, Welch": welch(groups).p < ALPHA,
        "variances, Brown and Forsythe": brown_forsythe(groups).p < ALPHA,
        "any pair, Tukey": any(tukey_differs(groups, *pair) for pair in itertools.combinations(groups, 2)),
    }
    for kind in kinds:
        tests = zip(EFFECTS, two_way_statistics(values, first, second, kind), strict=True)
        found |= {f"{effect}, Type {'I' * kind}": f.sf(*test) < ALPHA for effect, test in tests}
    return {name: int(one) for name, one in found.items()}


def lines(result: dict[str, Any]) -> Iterator[str]:
    """The result as text: a line per test."""
    error = (ALPHA * (1 - ALPHA) / result["studies"]) ** 0.5
    yield f"{result['studies']} studies of 447 people without any effect; a rate is known to {error:.2%}"
    for name, rate in result["rates"].items():
        yield f"{name}: {rate:.2%} false positives (4 to 6 %: {_verdict(rate, 2 * error)})"


def _verdict(rate: float, margin: float) -> str:
    low, high = BAND
    if low + margin <= rate <= high - margin:
        return "pass"
    return "FAIL" if rate < low - margin or rate > high + margin else "too few studies to say"
