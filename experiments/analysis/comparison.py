"""Compare assistance conditions using pairs of trials that differ only in the condition.

The effect size d_z is the mean of the paired differences divided by their standard deviation. Its interval
is computed from the noncentral t distribution (Cumming and Finch 2001, doi:10.1177/0013164401614002), and the
interval of the mean difference from Student's t distribution.
"""

import itertools
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t

from experiments.analysis.statistics.effects import t_interval
from experiments.errors import ConfigError, RecordError
from experiments.record.phases import origin_of
from experiments.trials.design import counted
from experiments.trials.table import NAME, read_rows
from experiments.trials.trial_config import SEEDS

CIRCUMSTANCES = (
    "objects",
    "user",
    "house",
    "planner",
    "fidelity",
    "points",
    "capacity",
    "time_limit",
    "episode",
)
CONFIDENCE = 0.95
SHOWN_SEEDS = 5
HUGE = 1e12  # largest accepted value of a metric, far above any realistic value

Row = Mapping[str, Any]
Interval = tuple[float, float] | None


@dataclass(frozen=True)
class Block:
    """A group of trials with equal settings. `rows` maps conditions to trials, keyed by seeds and person."""

    label: str
    rows: Mapping[str, Mapping[tuple[Any, ...], Row]]


@dataclass(frozen=True)
class Difference:
    """The difference between two conditions in one metric.

    Attributes:
        means: Mean of the metric in each condition, over all pairs.
        difference: Mean of the second condition minus mean of the first.
        interval: 95 % confidence interval of the difference, or None for fewer than two pairs.
        effect: Effect size d_z. If all differences are equal, `effect`, `effect_interval` and `p` are None.
        p: Two-sided p-value of the paired t test.
    """

    block: str
    metric: str
    conditions: tuple[str, str]
    pairs: int
    means: tuple[float, float]
    difference: float
    interval: Interval
    effect: float | None
    effect_interval: Interval
    p: float | None


def read_blocks(folder: Path) -> list[Block]:
    """Read the trials of a batch with at least two conditions, and group them by their settings."""
    path = folder / f"{NAME}.parquet"
    rows = read_rows(path)
    missing = [name for name in ("assistance", *SEEDS, *CIRCUMSTANCES) if rows and name not in rows[0]]
    if missing:
        raise RecordError(f"{path} was written by another version: it has no {', '.join(missing)}")
    if not all(isinstance(row["assistance"], str) for row in rows):
        raise RecordError(f"{path}: assistance is not a name in every row; correct it")
    if len({row["assistance"] for row in rows}) < 2:
        raise ConfigError(f"{folder} has fewer than two assistance conditions; there is nothing to compare")
    # Two trials form a pair only if they have the same seeds and the same person.
    identity = (*SEEDS, *(name for name in rows[0] if name.startswith("person_") and name not in SEEDS))
    varying = [name for name in CIRCUMSTANCES if len({row[name] for row in rows}) > 1]
    blocks: dict[str, dict[str, dict[tuple[Any, ...], Row]]] = defaultdict(lambda: defaultdict(dict))
    for row in rows:
        # The default time limit depends on the number of objects, so omit the limit if that number varies.
        label = ", ".join(f"{n} {row[n]}" for n in varying if n != "time_limit" or "objects" not in varying)
        person = tuple(row[name] for name in identity)
        if blocks[label][row["assistance"]].setdefault(person, row) is not row:
            seeds = ", ".join(f"{name} {row[name]}" for name in SEEDS)
            raise RecordError(
                f"{path} has two trials of {row['assistance']}, {seeds}; remove the one of another version"
            )
    return [Block(label, conditions) for label, conditions in blocks.items()]


def batch_origin(blocks: Sequence[Block]) -> str:
    rows = [row for block in blocks for found in block.rows.values() for row in found.values()]
    return origin_of(row["user"] for row in rows)


def missing_pairs(blocks: Sequence[Block]) -> Iterator[str]:
    """Yield a message for each pair of conditions in which some trials have no counterpart."""
    conditions = list(dict.fromkeys(name for block in blocks for name in block.rows))
    for block in blocks:
        where = f"{block.label}: " if block.label else ""
        for one, other in itertools.combinations(conditions, 2):
            here, there = set(block.rows.get(one, {})), set(block.rows.get(other, {}))
            if not here & there:
                yield f"{where}no trial of {one} has the same circumstances and seeds as one of {other}"
            elif here != there:
                lone = sorted(here ^ there)
                seeds = ", ".join(
                    "/".join(map(str, dict.fromkeys(s[: len(SEEDS)]))) for s in lone[:SHOWN_SEEDS]
                )
                yield f"{where}without a counterpart in {one} or {other}: {counted(len(lone), 'trial')}, seeds {seeds}"


def unknown_metrics(
    blocks: Sequence[Block], metrics: Sequence[str], differences: Sequence[Difference]
) -> Iterator[str]:
    """Yield a message for each metric that could not be compared in every pair of trials."""
    shown = {(d.block, d.metric, d.conditions) for d in differences}
    for d in differences:
        block = next(block for block in blocks if block.label == d.block)
        if gaps := len(_common(block, d.conditions)) - d.pairs:
            where = f"{d.block}: " if d.block else ""
            yield f"{where}{d.metric} is not known in {counted(gaps, 'pair')} of {' and '.join(d.conditions)}, left out"
    for block in blocks:
        where = f"{block.label}: " if block.label else ""
        for metric in metrics:
            pairs = [pair for pair in itertools.combinations(block.rows, 2) if _common(block, pair)]
            lost = [" and ".join(pair) for pair in pairs if (block.label, metric, pair) not in shown]
            if lost:
                yield f"{where}{metric} is not known in both trials of any pair of {', '.join(lost)}"


def compare(blocks: Sequence[Block], metrics: Sequence[str]) -> list[Difference]:
    """Compare all pairs of conditions in the given metrics. Trials with missing values are skipped."""
    rows = [row for block in blocks for found in block.rows.values() for row in found.values()]
    known = [name for name in rows[0] if all(_is_number(row[name]) for row in rows)]
    for name in metrics:
        if name not in known:
            raise ConfigError(f"no metric {name!r}; there are {', '.join(known)}")
        if huge := next((row[name] for row in rows if HUGE < abs(row[name] or 0) < math.inf), None):
            raise ConfigError(f"{name} has the impossible value {huge:g}; correct or remove that row")
    found = [
        difference
        for block in blocks
        for metric in metrics
        for pair in itertools.combinations(block.rows, 2)
        if (difference := _compare(block, metric, pair)) is not None
    ]
    if not found:
        raise ConfigError(
            f"there are no pairs to compare: {next(missing_pairs(blocks), 'no metric is known')}"
        )
    return found


def _is_number(value: object) -> bool:
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _compare(block: Block, metric: str, conditions: tuple[str, str]) -> Difference | None:
    one, other = (block.rows[name] for name in conditions)
    values = np.array(
        [(one[key][metric], other[key][metric]) for key in _common(block, conditions)], float
    ).reshape(-1, 2)
    values = values[np.isfinite(values).all(axis=1)]  # skip pairs with a missing value (NaN)
    if not len(values):
        return None
    gaps = values[:, 1] - values[:, 0]
    means = values.mean(axis=0)
    return Difference(
        block.label,
        metric,
        conditions,
        len(gaps),
        (float(means[0]), float(means[1])),
        float(gaps.mean()),
        mean_interval(gaps),
        *_effect(gaps),
    )


def _common(block: Block, conditions: tuple[str, str]) -> list[tuple[Any, ...]]:
    one, other = (block.rows[name] for name in conditions)
    return sorted(one.keys() & other.keys())


def mean_interval(values: NDArray[np.float64]) -> Interval:
    """Return the 95 % t interval of the mean of values, shape (n,), or None if there are fewer than two."""
    if len(values) < 2:
        return None
    half = float(t.ppf(0.5 + CONFIDENCE / 2, len(values) - 1) * values.std(ddof=1) / math.sqrt(len(values)))
    return float(values.mean()) - half, float(values.mean()) + half


def _effect(gaps: NDArray[np.float64]) -> tuple[float | None, Interval, float | None]:
    count = len(gaps)
    spread = float(gaps.std(ddof=1)) if count > 1 else 0.0
    if spread <= 1e-12 * max(1.0, float(np.abs(gaps).max())):
        return None, None, None
    effect, root = float(gaps.mean()) / spread, math.sqrt(count)
    statistic, freedom = effect * root, count - 1
    found = t_interval(statistic, freedom, CONFIDENCE)
    interval = None if found is None else (found[0] / root, found[1] / root)
    return effect, interval, float(2 * t.sf(abs(statistic), freedom))
