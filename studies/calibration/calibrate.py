"""Calibrate simulated participants: learn surrogate models from a pool, then fit the free parameters."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.analysis.study.table import StudyTable
from experiments.errors import RecordError, StatisticsError
from experiments.participants.distribution import Distributions
from experiments.record.phases import origin_of
from experiments.trials.exclusions import LeftOut
from mjsim.support.files import read_text
from studies.calibration.inference import OBJECTS, Cells, Fit, Rows, fit
from studies.calibration.population import FreeParameters
from studies.calibration.surrogate import Surrogate, Values, learn
from studies.published import Published

IDENTIFIED, WEAKLY = 0.7, 0.3  # minimum contraction of an identified and of a weakly identified parameter
TRADE_OFF = 0.4  # minimum absolute rank correlation of interchangeable parameters


@dataclass(frozen=True, eq=False)
class Calibration:
    """A fitted population of simulated participants, and the data that it was fitted to.

    Attributes:
        origin: Label that tells whether the participants in the pool were simulated.
        free: The free parameters and their priors.
        rows: The published results that were fitted.
        surrogates: Surrogate model of the measures in `rows`, by condition.
        fit: The draws and their distances from the published study.
        seed: Seed of the random number generator.
        left_out: Participants in the pools who were excluded.
    """

    origin: str
    free: FreeParameters
    rows: Rows
    surrogates: Cells
    fit: Fit
    seed: int
    left_out: tuple[LeftOut, ...]

    def behaviour(self) -> Distributions:
        """Return the best population, with its parameters rounded to three significant digits."""
        rounded = [float(f"{value:.3g}") for value in self.fit.draws[self.fit.best]]
        return self.free.behaviour(np.array(rounded))

    def identified(self) -> list[str]:
        """Describe for each free parameter how well the published results identify it."""
        words = ((IDENTIFIED, "identified"), (WEAKLY, "weakly"))
        return [
            next((word for least, word in words if c >= least), "not identified")
            for c in self.fit.contraction()
        ]

    def trade_offs(self) -> list[tuple[str, str, float]]:
        """Return pairs of parameters that can compensate for each other, with their rank correlations."""
        names, found = list(self.free.priors), self.fit.trade_offs()
        pairs = [
            (names[i], names[j], float(found[i, j]))
            for i in range(len(names))
            for j in range(i + 1, len(names))
        ]
        return sorted((p for p in pairs if abs(p[2]) >= TRADE_OFF), key=lambda p: -abs(p[2]))


def calibrate(
    pools: Sequence[StudyTable],
    free: FreeParameters,
    published: Published,
    *,
    draws: int,
    seed: int,
    on_progress: Callable[[int], None] = lambda _: None,
) -> Calibration:
    """Learn surrogate models from the pools and fit the free parameters to the published results at 6
    objects.

    Args:
        pools: Tables of simulated participants with widely varied parameters. Only cells with 6 objects are
            used.
        free: The parameters to fit.
        published: The published results.
        draws: Number of populations to draw.
        seed: Seed of the random number generator.
        on_progress: Called with the number of finished draws.

    Raises:
        RecordError: A parameter is missing in a table.
        StatisticsError: No surrogate model can be learned for a cell. The message names the cell.
    """
    rows = Rows.of(published)
    cells = {name: _surrogate(pools, rows.measures(), name, free.inputs()) for name in rows.sizes}
    origin = origin_of(row["user"] for pool in pools for row in pool.rows)
    found = fit(free, cells, rows, draws=draws, seed=seed, on_progress=on_progress)
    absent = tuple(person for pool in pools for person in pool.left_out)
    return Calibration(origin, free, rows, cells, found, seed, absent)


def _surrogate(
    pools: Sequence[StudyTable], measures: Sequence[str], condition: str, inputs: Sequence[str]
) -> Surrogate:
    parts = [_people(pool, measures, condition, inputs) for pool in pools]
    people, outcomes = (np.concatenate(part) for part in zip(*parts, strict=True))
    try:
        return learn(people, outcomes)
    except StatisticsError as error:
        raise StatisticsError(f"{condition}, {OBJECTS} objects: {error}") from error


def _people(
    pool: StudyTable, measures: Sequence[str], condition: str, inputs: Sequence[str]
) -> tuple[Values, Values]:
    """Return the parameters (n, inputs) and measures (n, measures) of the participants in a cell."""
    unknown = [name for name in measures if name not in pool.columns]
    if unknown:
        raise StatisticsError(f"{unknown[0]} is not known of the pool")
    outcomes = np.column_stack([pool.columns[name] for name in measures])
    here = (pool.assistance == condition) & (pool.objects == OBJECTS) & ~np.isnan(outcomes).any(axis=1)
    people = [[_value(pool.rows[k], name) for name in inputs] for k in np.flatnonzero(here).tolist()]
    return np.array(people, float).reshape(-1, len(inputs)), outcomes[here]


def _value(row: Any, name: str) -> float:
    value = row.get(f"behaviour_{name.replace('.', '_')}")
    if value is None:
        raise RecordError(
            f"the pool has no {name}; its people must be guests, as in experiments/trials/designs/pool.toml"
        )
    return float(value)


def fitted_study(study: Path, behaviour: Distributions, about: str) -> str:
    """Return the text of a study file in which all cells have the given population.

    Raises:
        RecordError: The study file already describes a population.
    """
    text = read_text(study)
    if "behaviour]" in text:
        text, _, _ = text.partition("\n# Fitted")
        if "behaviour]" in text:
            raise RecordError(f"{study} describes a population of its own; name a study that does not")
    lines = [f"{name} = {as_toml(value)}" for name, value in behaviour.as_dict().items()]
    return "\n".join([text.rstrip(), "", f"# Fitted {about}", "[all_cells.behaviour]", *lines, ""])


def as_toml(value: Any) -> str:
    """Format a number, list or dictionary as one line of TOML, with four significant digits."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{name} = {as_toml(part)}" for name, part in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    return str(float(f"{value:.4g}"))
