"""Sample size of the next study from the variance of simulated people: for a wanted effect, with its uncertainty.

The noncentral F gives the number, bootstrapping the pool its uncertainty; studies drawn from the pool show whether it
holds for data that are not normally distributed and vary more in some conditions than in others.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from experiments.analysis.planning.cost import StudyCost
from experiments.analysis.statistics.anova import EFFECTS, Values, one_way, two_way, two_way_squares
from experiments.analysis.statistics.effects import ALPHA
from experiments.analysis.statistics.noncentral import Interval
from experiments.analysis.statistics.power import POWER, people_per_cell
from experiments.analysis.study.table import StudyTable
from experiments.errors import ConfigError, StatisticsError
from experiments.trials.exclusions import LeftOut

RESAMPLES = 200  # of the pool
STUDIES = 400  # drawn to see whether the power holds
SHARE = 0.9  # of the interval
MIN_POOL = 10  # people of a cell of the pool

Cell = tuple[str, int]
Pool = Mapping[Cell, Values]


@dataclass(frozen=True)
class Wanted:
    """The effect that a study should find."""

    measure: str  # short name of the measure
    effect: str = "assistance"  # `assistance`, `objects` or `interaction`
    # between the largest and the smallest mean of a factor's levels, in units of the measure, with the
    # other means in the middle, which is the hardest case. Or None.
    difference: float | None = None
    # partial eta squared instead, or None. With neither, the effect is that of the pool.
    eta_squared: float | None = None
    power: float = POWER  # probability of finding it
    alpha: float = ALPHA  # level of the test

    def __post_init__(self) -> None:
        if self.effect not in EFFECTS:
            raise ConfigError(f"there is no effect {self.effect!r}; there are {', '.join(EFFECTS)}")
        if self.difference is not None and self.eta_squared is not None:
            raise ConfigError("give a difference or an eta squared, not both")
        if self.difference is not None and (
            self.effect == "interaction" or not 0 < self.difference < math.inf
        ):
            raise ConfigError(
                f"a difference of {self.difference:g} must be above 0, and of assistance or objects"
            )
        for name in ("eta_squared", "power", "alpha"):
            value = getattr(self, name)
            if value is not None and not 0 < value < 1:
                raise ConfigError(f"{name} is {value:g}; it must lie between 0 and 1")


@dataclass(frozen=True)
class PowerPlan:
    """Sample size and cost of a study."""

    origin: str  # whether the people of the pool were simulated
    cells: int  # number of cells
    eta_squared: float  # partial eta squared of the wanted effect
    per_cell: int  # people in each cell
    # 90 % interval of it, by drawing the people of the pool again; None where it does not depend on them
    interval: tuple[int, int] | None
    power: float  # share of studies of that size, drawn from the pool, that find the effect
    power_error: float  # standard error of that share
    people: int  # number who finish, in all cells
    to_recruit: int  # number who must start
    cost: float  # in the currency of the pay
    hours: float  # of all people together
    cost_interval: Interval | None  # cost at both ends of `interval`, or None
    hours_interval: Interval | None  # hours at both ends of it, or None
    left_out: tuple[LeftOut, ...]  # people of the pool's table who are no people of the pool


def plan_power(
    cells: Sequence[Cell], table: StudyTable, wanted: Wanted, cost: StudyCost, *, seed: int = 0
) -> PowerPlan:
    """Compute the number of people that each cell (condition, number of objects) of a study needs.

    `table` is the pool of people in the same cells. Raises `ConfigError` if the design cannot show the effect,
    `StatisticsError` if the pool lacks people or does not vary, or too many people would be needed.
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
                f"the pool has {len(values)} people with {condition} and {objects} objects; {MIN_POOL} are needed"
            )
    if _variance(pool) <= 0.0:
        raise StatisticsError(f"{wanted.measure} does not vary within any cell of the pool")
    return pool


def _levels(pool: Pool, effect: str) -> list[str | int]:
    place = 0 if effect == "assistance" else 1
    return sorted({cell[place] for cell in pool}, key=str)


def _freedom(pool: Pool, effect: str) -> int:
    counts = [len(_levels(pool, name)) for name in EFFECTS[:2]]
    if math.prod(counts) != len(pool):
        raise ConfigError(
            "the cells are no full crossing of conditions and numbers of objects; tests need one"
        )
    freedom = {"assistance": counts[0] - 1, "objects": counts[1] - 1}
    found = freedom.get(effect, freedom["assistance"] * freedom["objects"])
    if found < 1:
        raise ConfigError(f"the study has one level only; there is no effect of {effect}")
    return found


def _variance(pool: Pool) -> float:
    """Variance within cells, every cell with the same weight."""
    return float(np.mean([v.var(ddof=1) for v in pool.values()]))


def _eta_squared(pool: Pool, wanted: Wanted, draws: int = 1) -> float:
    """Partial eta squared of the wanted effect, in cells of equal size.

    The means of a pool differ by chance too; those of people drawn from it (`draws` 2) by its chance and their own.
    """
    if wanted.eta_squared is not None:
        return wanted.eta_squared
    if wanted.difference is not None:
        ratio = wanted.difference**2 / (2 * len(_levels(pool, wanted.effect)) * _variance(pool))
        return ratio / (1 + ratio)
    chance = draws * _freedom(pool, wanted.effect) * float(np.mean([1 / len(v) for v in pool.values()]))
    squares = _squares({cell: float(v.mean()) for cell, v in pool.items()}, wanted.effect)
    ratio = (squares / _variance(pool) - chance) / len(pool)
    if ratio <= 0:
        raise StatisticsError(f"the pool shows no effect of {wanted.effect} on {wanted.measure}; name one")
    return ratio / (1 + ratio)


def _squares(means: Mapping[Cell, float], effect: str) -> float:
    """Sum of squares of an effect on means, one person in each cell."""
    values = np.array(list(means.values()))
    first, second = (np.array([cell[k] for cell in means]) for k in (0, 1))
    if len(set(second.tolist())) == 1 or len(set(first.tolist())) == 1:
        return float(((values - values.mean()) ** 2).sum())
    return two_way_squares(values, first, second)[effect]


def _interval(pool: Pool, wanted: Wanted, rng: np.random.Generator) -> tuple[int, int]:
    """90 % interval of the people in each cell: the more, the smaller the effect of people drawn from the pool."""
    drawn = {cell: rng.choice(v, (RESAMPLES, len(v))) for cell, v in pool.items()}
    sizes = []
    for k in range(RESAMPLES):
        try:
            sizes.append(_eta_squared({cell: v[k] for cell, v in drawn.items()}, wanted, draws=2))
        except StatisticsError:  # these people show no effect
            sizes.append(0.0)
    small, large = np.quantile(sizes, [(1 - SHARE) / 2, (1 + SHARE) / 2], method="nearest").tolist()
    cells, freedom = len(pool), _freedom(pool, wanted.effect)
    try:
        low, high = (people_per_cell(e, freedom, cells, wanted.power, wanted.alpha) for e in (large, small))
    except StatisticsError as error:
        raise StatisticsError(
            f"the pool does not say how many people are needed: its effect of {wanted.effect} is not clear of none; "
            "simulate more people, or name an effect"
        ) from error
    return low, high


def _with_effect(pool: Pool, wanted: Wanted, eta_squared: float) -> Pool:
    """The pool's people with the wanted effect, and no other, in place of its own."""
    own = wanted.difference is None and wanted.eta_squared is None
    pattern = _own_pattern(pool, wanted.effect) if own else _pattern(pool, wanted.effect)
    ratio = eta_squared / (1 - eta_squared) * len(pool) * _variance(pool)
    scale = math.sqrt(ratio / sum(step**2 for step in pattern.values()))
    return {cell: v - v.mean() + scale * pattern[cell] for cell, v in pool.items()}


def _pattern(pool: Pool, effect: str) -> dict[Cell, float]:
    """Means by cell, up to a factor: one extreme level against the other, or both factors' extremes crossed."""

    def step(cell: Cell, name: str) -> float:
        levels = _levels(pool, name)
        return {levels[0]: -1.0, levels[-1]: 1.0}.get(cell[0 if name == "assistance" else 1], 0.0)

    names = EFFECTS[:2] if effect == "interaction" else (effect,)
    return {cell: math.prod(step(cell, name) for name in names) for cell in pool}


def _own_pattern(pool: Pool, effect: str) -> dict[Cell, float]:
    """Means of the pool's cells, less those of the other effects; up to a factor, as chance enlarges them."""
    means = {cell: float(v.mean()) for cell, v in pool.items()}
    grand = float(np.mean(list(means.values())))

    def margin(cell: Cell, place: int) -> float:
        return float(np.mean([m for other, m in means.items() if other[place] == cell[place]])) - grand

    if effect != "interaction":
        return {cell: margin(cell, EFFECTS.index(effect)) for cell in pool}
    return {cell: m - grand - margin(cell, 0) - margin(cell, 1) for cell, m in means.items()}


def _drawn_power(pool: Pool, wanted: Wanted, size: int, rng: np.random.Generator) -> float:
    """Share of drawn studies with `size` people in each cell that find the effect."""
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
