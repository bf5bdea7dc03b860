"""Compute the statistical power of a study that uses several homes.

The variances are estimated with a mixed model of simulated participants. The design is balanced: all
conditions use the same homes and have equally many participants, who have equally many trials each. An effect
of a home on all conditions cancels in their differences. The power therefore depends on the variances
between participants and between trials, and on the interaction between condition and home.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
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
    """The power to detect a difference between conditions, for several numbers of homes and participants.

    Attributes:
        trials: Number of trials per participant.
        means: Mean of the measure in each condition.
        variances: Variances of participants, of the interaction of condition and home, and of the residual.
        power: Power for each number of homes (rows) and each number of participants per condition (columns).
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
    """Compute the power for every combination of a number of homes and a number of participants.

    Means and variances are estimated from the trials in `table`. If `difference` is given, it replaces the
    difference between the first and the last condition, and all other means are halfway between these two.

    Raises:
        ConfigError: A combination of numbers is not a valid design.
        StatisticsError: The variances cannot be estimated from the trials.
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
    """Compute the power of an F test that compares the means of the conditions.

    The degrees of freedom follow Satterthwaite. `people` is the number of participants per condition. A
    condition with fewer trials than there are homes uses one home per trial.
    """
    count, each = len(means), people * trials
    used = min(homes, each)
    left = variances["residual"]
    # The expected mean squares of participants and of homes
    of_people = left + trials * variances["person"]
    of_homes = left + each / used * variances[SLOPE]
    freedom = count * (people - 1), (count - 1) * (used - 1)
    # The lower limit of the residual degrees of freedom applies if every home is used only once.
    rest = max(count * each - sum(freedom) - used, freedom[0])
    variance = (of_people + of_homes - left) / each  # variance of the mean of a condition
    parts = np.array([of_people, of_homes, left]) ** 2 / np.array([*freedom, rest])
    df2 = variance**2 * each**2 / float(parts.sum())
    effect = float(np.square(np.array(means) - np.mean(means)).sum()) / variance
    return power_of(effect / (1.0 + effect), count - 1, df2, 1, alpha)


def draw(path: Path, found: HomesPower, measure: str) -> None:
    """Plot power against the number of homes, with one line per number of participants."""
    figure = Figure(figsize=(6.0, 3.8), layout="constrained")
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
