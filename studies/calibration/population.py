"""Populations of simulated people with free parameters: studies/calibration.toml."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.errors import ConfigError
from experiments.participants.distribution import Distribution, Distributions, distribution
from mjsim.support.files import read_text

FILE = Path(__file__).parents[1] / "calibration.toml"
Values = NDArray[np.float64]


@dataclass(frozen=True)
class FreeParameters:
    """What is fitted.

    Attributes:
        priors: Prior distribution by name.
        population: Distributions over people as in a design's table `behaviour`; names stand for free parameters.
    """

    priors: Mapping[str, Distribution]
    population: Mapping[str, Any]

    def draw(self, count: int, rng: np.random.Generator) -> Values:
        """So many draws from the priors, (count, parameters)."""
        shares = rng.random((count, len(self.priors)))
        columns = [[p.quantile(s) for s in shares[:, k]] for k, p in enumerate(self.priors.values())]
        return np.array(columns, float).T

    def behaviour(self, values: Values) -> Distributions:
        """The population of one draw, (parameters,)."""
        return Distributions.of(_filled(self.population, dict(zip(self.priors, values, strict=True))))

    def inputs(self) -> list[str]:
        """Parameters of the participant model whose distribution is fitted, sorted."""
        return list(self.behaviour(self._medians()))

    def people(self, values: Values, shares: Values) -> Values:
        """People of one draw: their values of `inputs`, (n, inputs).

        Args:
            values: The draw, (parameters,).
            shares: Random numbers from 0 to 1, the same set for every input in another order, (n, inputs).
        """
        levels = np.sort(shares[:, 0])
        found = [_quantiles(d, levels) for d in self.behaviour(values).values()]
        return np.array([q[np.searchsorted(levels, s)] for q, s in zip(found, shares.T, strict=True)]).T

    def _medians(self) -> Values:
        return np.array([prior.quantile(0.5) for prior in self.priors.values()])


def read_free_parameters(path: Path = FILE) -> FreeParameters:
    """The committed choice.

    Raises:
        ConfigError: The file is unusable; the message names it.
    """
    try:
        file = tomllib.loads(read_text(path))
        found = FreeParameters(
            {name: distribution(name, given) for name, given in file["free"].items()}, file["population"]
        )
        found.inputs()
    except (OSError, tomllib.TOMLDecodeError, KeyError, ConfigError) as error:
        raise ConfigError(f"cannot use {path}: {error}") from error
    return found


def stratified_shares(people: int, inputs: int, rng: np.random.Generator) -> Values:
    """Numbers from 0 to 1 that cover each input evenly (a Latin hypercube), (people, inputs)."""
    levels = (np.arange(people) + 0.5) / people
    return np.array([rng.permutation(levels) for _ in range(inputs)]).T


def _quantiles(described: Distribution, levels: Values) -> Values:
    if described.constant is not None:
        return np.full(len(levels), described.constant)
    return np.array([described.quantile(level) for level in levels.tolist()])


def _filled(given: Any, values: Mapping[str, float]) -> Any:
    """A description with the values of free parameters in the place of their names."""
    if isinstance(given, dict):
        return {name: _filled(part, values) for name, part in given.items()}
    if isinstance(given, list):
        return [_filled(part, values) for part in given]
    if not isinstance(given, str):
        return given
    if given not in values:
        raise ConfigError(f"no free parameter {given!r}; there are {', '.join(values)}")
    return float(values[given])
