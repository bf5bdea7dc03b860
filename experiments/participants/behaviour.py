"""How simulated people behave differently: the parameters of a participant model, drawn for each person.

A model says in its factory's attribute `behaviour` which parameters it has. A design or a study changes their
distributions in a cell's table `behaviour`; what it does not name is as the model says.
"""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import msgspec

from experiments.errors import ConfigError
from experiments.participants.distribution import Distribution, Distributions, converted

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True)
class Parameter:
    """A parameter that differs from person to person."""

    usual: float | Mapping[str, Any]  # how it is distributed over people, as in TOML
    lowest: float  # smallest value that makes sense
    highest: float  # largest value that makes sense
    unit: str  # of the value; empty for a plain number, `probability` for one from 0 to 1

    @functools.cached_property
    def spread(self) -> Distribution:
        """The distribution that `usual` describes, converted once, as that takes longer than to draw from it."""
        return converted(self.usual)

    def check(self, name: str, value: float) -> None:
        """Raise a ConfigError if a value is out of range."""
        if not self.lowest <= value <= self.highest:
            bounds = f"{self.lowest:.4g} to {self.highest:.4g} {self.unit}".rstrip()
            raise ConfigError(f"{name} must be {bounds}, got {value:.4g}")


def draw(
    parameters: Mapping[str, Parameter], described: Distributions, rng: "np.random.Generator", of: str
) -> dict[str, float]:
    """The values of a person by name. Each depends on its own random number, however many are described.

    `described` replaces usual distributions; `of` names in errors what has the parameters.
    """
    return quantiles(parameters, described, rng.random(len(parameters)).tolist(), of)


def quantiles(
    parameters: Mapping[str, Parameter], described: Distributions, shares: Sequence[float], of: str
) -> dict[str, float]:
    """As `draw`, with a number from 0 to 1 for each parameter instead of a generator."""
    for name in described:
        if name not in parameters:
            has = f"it has {', '.join(parameters)}" if parameters else "it has no parameters"
            raise ConfigError(f"{of} has no {name!r}; {has}")
    values = {}
    for share, (name, parameter) in zip(shares, parameters.items(), strict=True):
        try:
            spread = described.get(name) or parameter.spread
            values[name] = spread.quantile(share, parameter.lowest, parameter.highest)
        except (msgspec.ValidationError, ConfigError) as error:
            raise ConfigError(f"{name}: {error}") from error
    return values


def varies(usual: float | Mapping[str, Any], lowest: float, highest: float, unit: str = "") -> Any:
    """A field of a part of a participant model whose value differs from person to person; see `Parameter`."""
    return field(metadata={"parameter": Parameter(usual, lowest, highest, unit)})


def chance(usual: float | Mapping[str, Any]) -> Any:
    """As `varies`, for a probability."""
    return varies(usual, 0.0, 1.0, "probability")
