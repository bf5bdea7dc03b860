"""Power of a study in several homes, as a function of the numbers of homes, participants and trials.

The variances come from a mixed model of simulated participants. The design is balanced: every condition has the same
number of participants, every participant the same number of trials, and all conditions use the same homes. A home's
effect on all conditions cancels in their differences. The mean of a condition therefore varies with its participants,
with the interaction of condition and home, and with the trials.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from experiments.analysis.comparison_plot import mark_origin
from experiments.analysis.statistics.effects import power_of
from experiments.analysis.statistics.mixed import MIN_LEVELS, mixed_model
from experiments.analysis.study.analysis import random_factors
from experiments.analysis.study.table import StudyTable
from experiments.errors import ConfigError, StatisticsError
from mjsim.support.files import replacing

SLOPE = "house x assistance"


@dataclass(frozen=True)
class HomesPower:
    """Power to detect a difference between conditions, by number of homes and participants per condition.

    Attributes:
        trials: Number of trials per participant.
        means: Mean of the measure in each condition.
        variances: Variances between participants, of the interaction of condition and home, and of the residual.
        power: Matrix of power, with one row per number of homes and one column per number of participants.
    """

    origin: str
    column: str
    trials: int
    means: Mapping[str, float]
    variances: Mapping[str, float]
    homes: tuple[int, ...]
    people: tuple[int, ...]
    power: tuple[tuple[float, ...], ...]


def homes_power(
    table: StudyTable,
    measure: str,
    homes: Sequence[int],
    people: Sequence[int],
    trials: int,
    *,
    difference: float | None = None,
    alpha: float = 0.05,
) -> HomesPower:
    """Compute the power for each combination of `homes` and `people` from a pool of trials in several homes.

    The condition means are taken from the pool. If `difference` is given, it is the difference between the first and
    the last condition, and the means of the others are halfway between them.

    Raises:
        ConfigError: A combination does not form a valid design.
        StatisticsError: The variances cannot be estimated from the pool.
    """
    if measure not in table.columns:
        raise ConfigError(f"there is no measure {measure!r}; there are {', '.join(table.columns)}")
    if min(homes) < MIN_LEVELS or min(people) < 2 or not 1 <= trials <= min(homes):
        raise ConfigError(
            f"homes {min(homes)}, people {min(people)}, trials {trials}: a design needs at least {MIN_LEVELS} homes, 2 "
            "people per condition, and at most 1 trial per home"
        )
    variances = _variances(table, measure)
    means = {c: float(values.mean()) for c, values in table.groups(measure).items()}
    if difference is not None:
        names = list(means)
        means = dict.fromkeys(names, difference / 2) | {names[0]: 0.0, names[-1]: difference}
    effect = list(means.values())
    found = tuple(
        tuple(power_of_design(effect, variances, n, m, trials, alpha) for m in people) for n in homes
    )
    return HomesPower(
        table.origin, table.sources[measure], trials, means, variances, tuple(homes), tuple(people), found
    )


def _variances(table: StudyTable, measure: str) -> dict[str, float]:
    here = table.take(np.flatnonzero(~np.isnan(table.columns[measure])))
    factors = random_factors(here)
    if missing := {"person", SLOPE} - set(factors):
        raise StatisticsError(
            f"the pool has no data on the variance of {', '.join(sorted(missing))}: people need several trials "
            "(trials_per_person), and houses several trials of a condition"
        )
    model = mixed_model(here.columns[measure], here.assistance, here.objects, factors)
    found = {name: model.random[name].variance for name in ("person", SLOPE)}
    return found | {"residual": model.residual_variance}


def power_of_design(
    means: Sequence[float],
    variances: Mapping[str, float],
    homes: int,
    people: int,
    trials: int,
    alpha: float = 0.05,
) -> float:
    """Compute the power of an F test of the conditions with Satterthwaite's degrees of freedom.

    `people` is the number per condition. If a condition has fewer trials than there are homes, it uses one home per
    trial.
    """
    count, each = len(means), people * trials
    used = min(homes, each)
    left = variances["residual"]
    # Expected mean squares of participants and of homes
    of_people = left + trials * variances["person"]
    of_homes = left + each / used * variances[SLOPE]
    freedom = count * (people - 1), (count - 1) * (used - 1)
    # Residual degrees of freedom, which are fewest if no home is shared
    rest = max(count * each - sum(freedom) - used, freedom[0])
    variance = (of_people + of_homes - left) / each  # variance of each condition's mean
    parts = np.array([of_people, of_homes, left]) ** 2 / np.array([*freedom, rest])
    df2 = variance**2 * each**2 / float(parts.sum())
    effect = float(np.square(np.array(means) - np.mean(means)).sum()) / variance
    return power_of(effect / (1.0 + effect), count - 1, df2, 1, alpha)


def draw(path: Path, found: HomesPower, measure: str) -> None:
    """Plot power against the number of homes, with one line per number of participants."""
    figure = Figure(figsize=(6.0, 3.8), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    for k, people in enumerate(found.people):
        axes.plot(found.homes, [row[k] for row in found.power], "o-", ms=4, label=f"{people} people")
    axes.axhline(0.8, color="#999999", lw=0.8, ls="--")
    axes.set_xscale("log")
    axes.set_xticks(found.homes, [str(n) for n in found.homes], minor=False)
    axes.minorticks_off()
    axes.set_ylim(0, 1.02)
    axes.set_xlabel("homes")
    axes.set_ylabel(f"power to detect the effect on {measure}")
    axes.legend(title=f"per condition, {found.trials} trials each", fontsize=8, frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    mark_origin(figure, found.origin)
    with replacing(path) as temporary:
        figure.savefig(temporary, format="png", dpi=120, metadata={"Software": "mjsim"})
