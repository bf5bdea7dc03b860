"""Estimate the sample size and the cost of a planned study from simulated participants.

The sample size is computed from the noncentral F distribution. Its confidence interval is obtained by
bootstrapping the simulated participants. Random samples of these participants are then tested to check that
the power is also reached with data that are not normal or have unequal variances.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from experiments.analysis.statistics.anova import EFFECTS, Values, one_way, two_way, two_way_squares
from experiments.analysis.statistics.effects import ALPHA, POWER, Interval, people_per_cell
from experiments.analysis.study.table import StudyTable
from experiments.errors import ConfigError, StatisticsError
from experiments.trials.design import counted
from experiments.trials.exclusions import LeftOut

RESAMPLES = 200  # number of bootstrap resamples for the interval of the sample size
STUDIES = 400  # number of random samples with which the power is checked
COVERAGE = 0.9  # confidence level of the interval for the sample size
MIN_POOL = 10  # minimum number of simulated participants per cell of the design

Cell = tuple[str, int]
Pool = Mapping[Cell, Values]


@dataclass(frozen=True)
class StudyCost:
    """Assumptions about the pay, the platform fee, the dropout rate and the time per participant.

    Attributes:
        fee: Platform fee as a fraction of the pay.
        dropout: Fraction of participants who start but do not finish.
    """

    pay: float = 7.5  # value from the paper (PAPER section 7)
    fee: float = 0.0
    minutes: float = 25.0  # value from the paper (PAPER section 7)
    dropout: float = 0.15

    def __post_init__(self) -> None:
        for name in ("pay", "fee", "minutes", "dropout"):
            value = getattr(self, name)
            if not 0 <= value < (1 if name == "dropout" else math.inf):
                raise ConfigError(
                    f"{name} is {value:g}; it must be 0 or more{', below 1' * (name == 'dropout')}"
                )

    def total(self, people: int) -> float:
        """Return the total cost of a study if `people` participants finish it."""
        return people * self.pay * (1 + self.fee)

    def hours(self, people: int) -> float:
        """Return the hours spent by all participants, including dropouts, if `people` of them finish."""
        return self.to_recruit(people) * self.minutes / 60

    def to_recruit(self, people: int) -> int:
        """Return the number of participants to recruit so that `people` of them finish."""
        return math.ceil(people / (1 - self.dropout) - 1e-9)


@dataclass(frozen=True)
class Wanted:
    """The effect that a planned study should detect. By default, its size is estimated from simulations.

    Attributes:
        measure: Short name of the measure.
        effect: `assistance`, `objects` or `interaction`.
        difference: Largest difference between the means of a factor's levels, in units of the measure, or
            None. All other means are assumed to be halfway between, which makes the effect hardest to detect.
        eta_squared: Partial eta squared of the effect, or None.
        power: Probability of detecting the effect.
        alpha: Significance level.
    """

    measure: str
    effect: str = "assistance"
    difference: float | None = None
    eta_squared: float | None = None
    power: float = POWER
    alpha: float = ALPHA

    def __post_init__(self) -> None:
        if self.effect not in EFFECTS:
            raise ConfigError(f"there is no effect {self.effect!r}; there are {', '.join(EFFECTS)}")
        if self.difference is not None and self.eta_squared is not None:
            raise ConfigError("give a difference or an eta squared, not both")
        if self.difference is not None and (
            self.effect == "interaction" or not 0 < self.difference < math.inf
        ):
            raise ConfigError(
                f"difference is {self.difference:g}; it must be above 0, and the effect assistance or objects"
            )
        for name in ("eta_squared", "power", "alpha"):
            value = getattr(self, name)
            if value is not None and not 0 < value < 1:
                raise ConfigError(f"{name} is {value:g}; it must be between 0 and 1")


@dataclass(frozen=True)
class PowerPlan:
    """The sample size and the cost of a planned study.

    Attributes:
        interval: 90 % bootstrap interval of `per_cell`, or None if `eta_squared` was specified.
        power: Fraction of random samples of this size in which the effect is detected.
        power_error: Standard error of `power`.
        people: Total number of participants who must finish.
        to_recruit: Number of participants to recruit, including expected dropouts.
    """

    origin: str
    cells: int
    eta_squared: float
    per_cell: int
    interval: tuple[int, int] | None
    power: float
    power_error: float
    people: int
    to_recruit: int
    cost: float
    hours: float
    cost_interval: Interval | None
    hours_interval: Interval | None
    left_out: tuple[LeftOut, ...]


def plan_power(
    cells: Sequence[Cell], table: StudyTable, wanted: Wanted, cost: StudyCost, *, seed: int = 0
) -> PowerPlan:
    """Compute how many participants a study needs for each combination of condition and number of objects.

    `table` contains simulated participants with the same combinations.

    Raises:
        ConfigError: The effect cannot be tested with this design.
        StatisticsError: `table` has too few participants or no variance, or the study would need too many.
    """
    pool, rng = _pool(cells, table, wanted), np.random.default_rng(seed)
    eta_squared = _eta_squared(pool, wanted)
    freedom = _freedom(pool, wanted.effect)
    needed = people_per_cell(eta_squared, freedom, len(pool), wanted.power, wanted.alpha)
    interval = None if wanted.eta_squared is not None else _interval(pool, wanted, rng)
    power = _drawn_power(_with_effect(pool, wanted, eta_squared), wanted, needed, rng)
    people = needed * len(pool)
    ends = None if interval is None else [n * len(pool) for n in interval]
    return PowerPlan(
        table.origin,
        len(pool),
        eta_squared,
        needed,
        interval,
        power,
        math.sqrt(power * (1 - power) / STUDIES),
        people,
        cost.to_recruit(people),
        cost.total(people),
        cost.hours(people),
        None if ends is None else (cost.total(ends[0]), cost.total(ends[1])),
        None if ends is None else (cost.hours(ends[0]), cost.hours(ends[1])),
        table.left_out,
    )


def _pool(cells: Sequence[Cell], table: StudyTable, wanted: Wanted) -> Pool:
    if wanted.measure not in table.columns:
        raise ConfigError(f"there is no measure {wanted.measure!r}; there are {', '.join(table.columns)}")
    pool = {c: table.groups(wanted.measure, c[1]).get(c[0], np.zeros(0)) for c in sorted(set(cells))}
    _freedom(pool, wanted.effect)
    for (condition, objects), values in pool.items():
        if len(values) < MIN_POOL:
            raise StatisticsError(
                f"the pool has {len(values)} people with {condition} and {counted(objects, 'object')}; "
                f"{MIN_POOL} are needed"
            )
    if _variance(pool) <= 0.0:
        raise StatisticsError(f"{wanted.measure} does not vary within any cell of the pool")
    return pool


def _levels(pool: Pool, effect: str) -> list[str | int]:
    factor = 0 if effect == "assistance" else 1
    return sorted({cell[factor] for cell in pool}, key=str)


def _freedom(pool: Pool, effect: str) -> int:
    counts = [len(_levels(pool, name)) for name in EFFECTS[:2]]
    if math.prod(counts) != len(pool):
        raise ConfigError(
            "the tests need a full crossing of conditions and numbers of objects; some cells are missing"
        )
    freedom = {"assistance": counts[0] - 1, "objects": counts[1] - 1}
    found = freedom.get(effect, freedom["assistance"] * freedom["objects"])
    if found < 1:
        raise ConfigError(f"the study has only one level; there is no effect of {effect}")
    return found


def _variance(pool: Pool) -> float:
    return float(np.mean([v.var(ddof=1) for v in pool.values()]))


def _eta_squared(pool: Pool, wanted: Wanted, draws: int = 1) -> float:
    if wanted.eta_squared is not None:
        return wanted.eta_squared
    if wanted.difference is not None:
        ratio = wanted.difference**2 / (2 * len(_levels(pool, wanted.effect)) * _variance(pool))
        return ratio / (1 + ratio)
    chance = draws * _freedom(pool, wanted.effect) * float(np.mean([1 / len(v) for v in pool.values()]))
    squares = _squares({cell: float(v.mean()) for cell, v in pool.items()}, wanted.effect)
    ratio = (squares / _variance(pool) - chance) / len(pool)
    if ratio <= 0:
        raise StatisticsError(
            f"the pool shows no effect of {wanted.effect} on {wanted.measure}; give its size"
        )
    return ratio / (1 + ratio)


def _squares(means: Mapping[Cell, float], effect: str) -> float:
    values = np.array(list(means.values()))
    first, second = (np.array([cell[k] for cell in means]) for k in (0, 1))
    if len(set(second.tolist())) == 1 or len(set(first.tolist())) == 1:
        return float(((values - values.mean()) ** 2).sum())
    return two_way_squares(values, first, second, effects=[effect])[effect]


def _interval(pool: Pool, wanted: Wanted, rng: np.random.Generator) -> tuple[int, int]:
    drawn = {cell: rng.choice(v, (RESAMPLES, len(v))) for cell, v in pool.items()}
    sizes = []
    for k in range(RESAMPLES):
        try:
            sizes.append(_eta_squared({cell: v[k] for cell, v in drawn.items()}, wanted, draws=2))
        except StatisticsError:  # this resample shows no effect
            sizes.append(0.0)
    small, large = np.quantile(sizes, [(1 - COVERAGE) / 2, (1 + COVERAGE) / 2], method="nearest").tolist()
    cells, freedom = len(pool), _freedom(pool, wanted.effect)
    try:
        low, high = (people_per_cell(e, freedom, cells, wanted.power, wanted.alpha) for e in (large, small))
    except StatisticsError as error:
        raise StatisticsError(
            f"the pool is too small: its effect of {wanted.effect} could be zero; simulate more people, or give the "
            "size of the effect"
        ) from error
    return low, high


def _with_effect(pool: Pool, wanted: Wanted, eta_squared: float) -> Pool:
    own = wanted.difference is None and wanted.eta_squared is None
    pattern = _own_pattern(pool, wanted.effect) if own else _pattern(pool, wanted.effect)
    ratio = eta_squared / (1 - eta_squared) * len(pool) * _variance(pool)
    scale = math.sqrt(ratio / sum(step**2 for step in pattern.values()))
    return {cell: v - v.mean() + scale * pattern[cell] for cell, v in pool.items()}


def _pattern(pool: Pool, effect: str) -> dict[Cell, float]:
    """Return contrast weights by cell: -1 and 1 at the first and last level of a factor, and 0 elsewhere."""

    def step(cell: Cell, name: str) -> float:
        levels = _levels(pool, name)
        return {levels[0]: -1.0, levels[-1]: 1.0}.get(cell[0 if name == "assistance" else 1], 0.0)

    names = EFFECTS[:2] if effect == "interaction" else (effect,)
    return {cell: math.prod(step(cell, name) for name in names) for cell in pool}


def _own_pattern(pool: Pool, effect: str) -> dict[Cell, float]:
    """Return the contribution of an effect to each cell mean. The caller corrects its size for chance."""
    means = {cell: float(v.mean()) for cell, v in pool.items()}
    grand = float(np.mean(list(means.values())))

    def margin(cell: Cell, factor: int) -> float:
        return float(np.mean([m for other, m in means.items() if other[factor] == cell[factor]])) - grand

    if effect != "interaction":
        return {cell: margin(cell, EFFECTS.index(effect)) for cell in pool}
    return {cell: m - grand - margin(cell, 0) - margin(cell, 1) for cell, m in means.items()}


def _drawn_power(pool: Pool, wanted: Wanted, size: int, rng: np.random.Generator) -> float:
    first, second = (np.repeat([cell[k] for cell in pool], size) for k in (0, 1))
    crossed = len(set(first.tolist())) > 1 and len(set(second.tolist())) > 1
    found = 0
    for _ in range(STUDIES):
        groups = {str(cell): rng.choice(v, size) for cell, v in pool.items()}
        if crossed:
            test = two_way(np.concatenate(list(groups.values())), first, second)[wanted.effect]
        else:
            test = one_way(groups)
        found += test.p < wanted.alpha
    return found / STUDIES
