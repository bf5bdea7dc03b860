"""How simulated people behave differently: the parameters of a participant model, drawn for each person.

A model says in its factory's attribute `behaviour` which parameters it has. A design or a study changes their
distributions in a cell's table `behaviour`; what it does not name is as the model says.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from experiments.distribution import AnyDistribution, distribution, is_distribution
from experiments.errors import ConfigError


@dataclass(frozen=True)
class Parameter:
    """A parameter of a participant model.

    Attributes:
        usual: How it is distributed over people, as in TOML.
        lowest: Smallest value that makes sense.
        highest: Largest value that makes sense.
        unit: Of the value; empty for a plain number, `probability` for one from 0 to 1.
    """

    usual: float | Mapping[str, Any]
    lowest: float
    highest: float
    unit: str


@dataclass(frozen=True)
class BehaviourDistribution:
    """Distributions of parameters of a participant model by name, sorted; what is not named is as the model says.

    Attributes:
        parameters: Name (`compliance.follows`), and distribution of the value.
    """

    parameters: tuple[tuple[str, AnyDistribution], ...] = ()

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> "BehaviourDistribution":
        """Distributions as in TOML; tables of several are joined with a dot: `[compliance] follows = 1`.

        Raises:
            ConfigError: A description is malformed.
        """
        found: dict[str, AnyDistribution] = {}
        for name, value in values.items():
            if is_distribution(value):
                found[name] = distribution(name, value)
            else:
                inner = {f"{name}.{part}": given for part, given in value.items()}
                found |= {part: distribution(part, given) for part, given in inner.items()}
        return cls(tuple(sorted(found.items(), key=lambda item: item[0])))

    def as_dict(self) -> dict[str, Any]:
        """The description, as `of` takes it."""
        return {name: described.as_value() for name, described in self.parameters}

    def updated(self, other: "BehaviourDistribution") -> "BehaviourDistribution":
        """These distributions, replaced by those of `other` where it has any."""
        return BehaviourDistribution(
            tuple(
                sorted({**dict(self.parameters), **dict(other.parameters)}.items(), key=lambda item: item[0])
            )
        )

    def draw(
        self, model: str, parameters: Mapping[str, Parameter], rng: np.random.Generator
    ) -> dict[str, float]:
        """The values of a person by name. Each depends on its own random number, however many are described.

        Args:
            model: Name of the participant, for errors.
            parameters: What the participant model has, by name.
            rng: Source of chance.

        Raises:
            ConfigError: The model has no parameter of a name, or a value out of its range.
        """
        described = dict(self.parameters)
        for name in described:
            if name not in parameters:
                has = f"it has {', '.join(parameters)}" if parameters else "it has no parameters"
                raise ConfigError(f"behaviour: participant {model!r} has no {name!r}; {has}")
        shares = rng.random(len(parameters)).tolist()
        values = {}
        for share, (name, parameter) in zip(shares, parameters.items(), strict=True):
            spread = described.get(name) or distribution(name, parameter.usual)
            values[name] = _value(name, parameter, spread, share)
        return values


def _value(name: str, parameter: Parameter, spread: AnyDistribution, share: float) -> float:
    low, high = parameter.lowest, parameter.highest
    try:
        value = spread.quantile(share, low, high)
    except ConfigError as error:
        raise ConfigError(f"behaviour.{name}: {error}") from error
    if not low <= value <= high:
        unit = f" {parameter.unit}" if parameter.unit else ""
        raise ConfigError(f"behaviour.{name} must be {low:.4g} to {high:.4g}{unit}, got {value:.4g}")
    return value


def varies(usual: float | Mapping[str, Any], lowest: float, highest: float, unit: str = "") -> Any:
    """A field of a part of a participant model, which every person has a value of its own of.

    Args:
        usual: How it is distributed over people, as in TOML.
        lowest: Smallest value that makes sense.
        highest: Largest value that makes sense.
        unit: Of the value.
    """
    return field(metadata={"parameter": Parameter(usual, lowest, highest, unit)})


def chance(usual: float | Mapping[str, Any]) -> Any:
    """As `varies`, for a probability."""
    return varies(usual, 0.0, 1.0, "probability")
