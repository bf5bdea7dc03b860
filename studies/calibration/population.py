"""Populations of simulated participants with free parameters, as described in studies/calibration.toml."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.errors import ConfigError
from experiments.participants.distribution import Distribution, Distributions, distribution
from mjsim.support.toml import TomlError, read_toml

FILE = Path(__file__).parents[1] / "calibration.toml"
Values = NDArray[np.float64]


@dataclass(frozen=True)
class FreeParameters:
    """The parameters to fit, with their priors.

    Attributes:
        priors: Prior distribution of each parameter, by name.
        population: The `behaviour` table of a design, with names of free parameters in place of numbers.
    """

    priors: Mapping[str, Distribution]
    population: Mapping[str, Any]

    def draw(self, count: int, rng: np.random.Generator) -> Values:
        """Return `count` draws from the priors, (count, parameters)."""
        shares = rng.random((count, len(self.priors)))
        columns = [[p.quantile(s) for s in shares[:, k]] for k, p in enumerate(self.priors.values())]
        return np.array(columns, float).T

    def behaviour(self, values: Values) -> Distributions:
        """Return the population that belongs to one draw (parameters,) of the free parameters."""
        return Distributions.of(_filled(self.population, dict(zip(self.priors, values, strict=True))))

    def inputs(self) -> list[str]:
        """Return the sorted names of the participant model's parameters whose distributions are fitted."""
        return list(self.behaviour(self._medians()))

    def people(self, values: Values, shares: Values) -> Values:
        """Return simulated participants of one draw as their values of `inputs`, (n, inputs).

        Args:
            values: One draw of the free parameters, (parameters,).
            shares: Random numbers from 0 to 1, (n, inputs). All columns hold the same numbers in different
                orders.
        """
        levels = np.sort(shares[:, 0])
        found = [_quantiles(d, levels) for d in self.behaviour(values).values()]
        return np.array([q[np.searchsorted(levels, s)] for q, s in zip(found, shares.T, strict=True)]).T

    def _medians(self) -> Values:
        return np.array([prior.quantile(0.5) for prior in self.priors.values()])


def read_free_parameters(path: Path = FILE) -> FreeParameters:
    """Load the free parameters from a TOML file.

    Raises:
        ConfigError: The file cannot be used. The message names it.
    """
    try:
        file = read_toml(path)
        found = FreeParameters(
            {name: distribution(name, given) for name, given in file["free"].items()}, file["population"]
        )
        found.inputs()
    except (OSError, TomlError, KeyError, ConfigError) as error:
        raise ConfigError(f"cannot use {path}: {error}") from error
    return found


def stratified_shares(people: int, inputs: int, rng: np.random.Generator) -> Values:
    """Return a Latin hypercube sample: numbers from 0 to 1 that cover each input evenly, (people, inputs)."""
    levels = (np.arange(people) + 0.5) / people
    return np.array([rng.permutation(levels) for _ in range(inputs)]).T


def _quantiles(described: Distribution, levels: Values) -> Values:
    if described.constant is not None:
        return np.full(len(levels), described.constant)
    return np.array([described.quantile(level) for level in levels.tolist()])


def _filled(given: Any, values: Mapping[str, float]) -> Any:
    """Replace the names of free parameters in a description by their values."""
    if isinstance(given, dict):
        return {name: _filled(part, values) for name, part in given.items()}
    if isinstance(given, list):
        return [_filled(part, values) for part in given]
    if not isinstance(given, str):
        return given
    if given not in values:
        raise ConfigError(f"no free parameter {given!r}; there are {', '.join(values)}")
    return float(values[given])
