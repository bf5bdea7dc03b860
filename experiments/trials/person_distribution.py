"""How people differ: a distribution for each value of a person, from which a trial draws its participant.

Distributions are given in TOML (`experiments.distribution`), in a file or between braces on the command line. Names and
units are those of `mjsim.PersonParameters`; values of a group are `motion.reach_time` and so on. What is not named is
the same for everybody.
"""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.distribution import AnyDistribution, distribution
from experiments.errors import ConfigError
from mjsim.errors import PersonError
from mjsim.motion_parameters import GROUPS
from mjsim.person_parameters import RANGES, PersonParameters

_NAMES = (*RANGES, *(f"{group}.{name}" for group, values in GROUPS.items() for name in values._fields))


@dataclass(frozen=True)
class PersonDistribution:
    """Distributions of the values of a person by name, sorted; nobody differs by default.

    Attributes:
        parameters: Name, and distribution of the value.

    Raises:
        ConfigError: A name is unknown, or a value for everybody is out of range.
    """

    parameters: tuple[tuple[str, AnyDistribution], ...] = ()

    def __post_init__(self) -> None:
        for name, _ in self.parameters:
            if name not in _NAMES:
                raise ConfigError(
                    f"a person has no {name!r}; it has {', '.join([*RANGES, *GROUPS])} (docs/people.md)"
                )
        self._quantiles({name: 0.5 for name, _ in self.parameters})

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> "PersonDistribution":
        """Distributions as in TOML: name -> number, or a table such as `{"normal": [1.2, 0.2], "min": 0.8}`.

        Raises:
            ConfigError: The description is malformed, or a value is out of range.
        """
        found: dict[str, AnyDistribution] = {}
        for name, value in values.items():
            if name in GROUPS and isinstance(value, Mapping):
                found |= {f"{name}.{part}": distribution(f"{name}.{part}", v) for part, v in value.items()}
            else:
                found[name] = distribution(name, value)
        return cls(tuple(sorted(found.items())))

    @classmethod
    def parse(cls, text: str) -> "PersonDistribution":
        """Read a TOML file, or a description between braces.

        Raises:
            ConfigError: The file cannot be read, or the description is malformed.
        """
        try:
            if text.lstrip().startswith("{"):
                return cls.of(tomllib.loads(f"person = {text}")["person"])
            return cls.of(tomllib.loads(Path(text).read_text(encoding="utf-8-sig")))
        except OSError as error:
            raise ConfigError(
                f"cannot read {text}: {error.strerror}; name a TOML file, or give values between braces, such as "
                "'{walking_speed = 1.2}'"
            ) from error
        except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
            raise ConfigError(f"{text!r} is not a description of people in TOML: {error}") from error

    def as_dict(self) -> dict[str, Any]:
        """The description, as `of` takes it."""
        return {name: described.as_value() for name, described in self.parameters}

    def updated(self, other: "PersonDistribution") -> "PersonDistribution":
        """These distributions, replaced by those of `other` where it has any."""
        return PersonDistribution(tuple(sorted({**dict(self.parameters), **dict(other.parameters)}.items())))

    def draw(self, rng: np.random.Generator) -> PersonParameters:
        """A person. Each value depends on its own random number: describing one more leaves the others as they were.

        Raises:
            ConfigError: A value cannot be drawn.
        """
        shares = dict(zip(_NAMES, rng.random(len(_NAMES)).tolist(), strict=True))
        return self._quantiles(shares)

    def _quantiles(self, shares: Mapping[str, float]) -> PersonParameters:
        values: dict[str, Any] = {}
        for name, described in self.parameters:
            low, high, _ = RANGES.get(name, (0.0, math.inf, ""))
            try:
                values[name] = described.quantile(shares[name], low, high)
            except ConfigError as error:
                raise ConfigError(f"{name}: {error}") from error
        if "motion.withdraw_steps" in values:
            values["motion.withdraw_steps"] = round(values["motion.withdraw_steps"])
        try:
            groups: dict[str, Any] = {
                group: usual(**{n.split(".")[1]: v for n, v in values.items() if n.startswith(f"{group}.")})
                for group, usual in GROUPS.items()
            }
            return PersonParameters(**groups, **{n: v for n, v in values.items() if n in RANGES})
        except PersonError as error:
            raise ConfigError(str(error)) from error
