"""A calibration from a pool of simulated people: surrogates, fit, and the study that follows."""

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

IDENTIFIED, WEAKLY = 0.7, 0.3  # contraction from which a parameter counts as identified, or as weakly so
TRADE_OFF = 0.4  # rank correlation from which two parameters count as exchangeable


@dataclass(frozen=True, eq=False)
class Calibration:
    """What was fitted, to what, by what.

    Attributes:
        origin: Whether the people of the pool were simulated.
        free: The free parameters with their priors.
        rows: The published rows.
        surrogates: Condition -> surrogate of the measures of `rows`.
        fit: The draws.
        seed: Of all chance.
        left_out: People of the pools from whom nothing is learnt.
    """

    origin: str
    free: FreeParameters
    rows: Rows
    surrogates: Cells
    fit: Fit
    seed: int
    left_out: tuple[LeftOut, ...]

    def behaviour(self) -> Distributions:
        """The best population, its parameters to three digits."""
        rounded = [float(f"{value:.3g}") for value in self.fit.draws[self.fit.best]]
        return self.free.behaviour(np.array(rounded))

    def identified(self) -> list[str]:
        """Of each free parameter, whether the published rows say what it is."""
        words = ((IDENTIFIED, "identified"), (WEAKLY, "weakly"))
        return [
            next((word for least, word in words if c >= least), "not identified")
            for c in self.fit.contraction()
        ]

    def trade_offs(self) -> list[tuple[str, str, float]]:
        """Pairs of parameters of which one can take the place of the other, with their rank correlation."""
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
    """Learn surrogates from a pool and fit the free parameters to the published rows at 6 objects.

    Args:
        pools: People in the cells of 6 objects, of one or more tables, with parameters drawn widely; people in other
            cells are left out.
        free: What is fitted.
        published: The published numbers.
        draws: How many populations are tried.
        seed: Of all chance.
        on_progress: Called with how many draws are done.

    Raises:
        RecordError: The table lacks a parameter.
        StatisticsError: A cell of the pool cannot be learnt from; the message names it.
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
    """Values (n, inputs) and measures (n, measures) of the people of a cell."""
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
    """The text of a study file with a population for all its cells; earlier ones must not be there.

    Raises:
        RecordError: The file has a population of its own.
    """
    text = read_text(study)
    if "behaviour]" in text:
        text, _, _ = text.partition("\n# Fitted")
        if "behaviour]" in text:
            raise RecordError(f"{study} describes a population of its own; name a study that does not")
    lines = [f"{name} = {as_toml(value)}" for name, value in behaviour.as_dict().items()]
    return "\n".join([text.rstrip(), "", f"# Fitted {about}", "[all_cells.behaviour]", *lines, ""])


def as_toml(value: Any) -> str:
    """A number, list or table of one line; numbers to four digits."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{name} = {as_toml(part)}" for name, part in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    return str(float(f"{value:.4g}"))
