"""How people differ: a distribution for each value of a person, from which a trial draws its participant.

A distribution is given in TOML, in a file or between braces on the command line:

    walking_speed = {normal = [1.2, 0.2], min = 0.8}   # mean and standard deviation
    reading_time = {lognormal = [1.35, 0.35]}          # median, and standard deviation of the logarithm
    reach = {uniform = [0.8, 1.1]}                     # lowest and highest
    field_of_view = 1.2                                # the same for everybody

Names and units are those of `mjsim.PersonParameters`; values of the hands are `motion.reach_time` and so on. What is
not named is the same for everybody.
"""

import math
import statistics
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.errors import ConfigError
from mjsim.errors import PersonError
from mjsim.person_parameters import RANGES, MotionParameters, PersonParameters

_STANDARD = statistics.NormalDist()
_SHAPES = ("normal", "lognormal", "uniform")
_NAMES = (*RANGES, *(f"motion.{name}" for name in MotionParameters._fields))


@dataclass(frozen=True)
class Distribution:
    """Distribution of one number.

    Attributes:
        shape: `constant`, `normal`, `lognormal` or `uniform`.
        first: The value, the mean, the median, or the lowest value.
        second: Nothing, the standard deviation, that of the logarithm, or the highest value.
        lowest: Smaller values do not occur.
        highest: Larger values do not occur.

    Raises:
        ConfigError: A number is not finite, or no values are left.
    """

    shape: str
    first: float
    second: float = 0.0
    lowest: float = -math.inf
    highest: float = math.inf

    def __post_init__(self) -> None:
        numbers = [self.first] if self.shape == "constant" else [self.first, self.second]
        if not all(map(math.isfinite, numbers)) or math.isnan(self.lowest) or math.isnan(self.highest):
            raise ConfigError(f"{', '.join(f'{n:g}' for n in numbers)}: every number must be finite")
        if self.shape == "uniform" and not self.first <= self.second:
            raise ConfigError(f"uniform takes the lowest value, then the highest; got {numbers}")
        if self.shape in ("normal", "lognormal") and not self.second > 0:
            raise ConfigError(f"the standard deviation of {self.shape} must be positive, got {self.second}")
        if self.shape == "lognormal" and not self.first > 0:
            raise ConfigError(f"the median of lognormal must be positive, got {self.first}")
        if not self.lowest <= self.highest:
            raise ConfigError(f"min must not exceed max, got {self.lowest} and {self.highest}")

    def as_value(self) -> float | dict[str, Any]:
        """The description, as in TOML."""
        if self.shape == "constant":
            return self.first
        limits = {"min": self.lowest, "max": self.highest}
        finite = {name: limit for name, limit in limits.items() if math.isfinite(limit)}
        return {self.shape: [self.first, self.second], **finite}

    def quantile(self, share: float, lowest: float, highest: float) -> float:
        """The value below which a share (0 to 1) of the distribution between two values lies.

        Raises:
            ConfigError: As good as nothing of the distribution lies between them.
        """
        if self.shape == "constant":
            return self.first
        low, high = max(self.lowest, lowest), min(self.highest, highest)
        below, above = self._share_below(low), self._share_below(high)
        if not low <= high or not above - below > 1e-6:
            raise ConfigError(
                f"{self.shape} = {[self.first, self.second]} has no values from {low:.4g} to {high:.4g}"
            )
        return min(high, max(low, self._value(below + share * (above - below))))

    def _share_below(self, value: float) -> float:
        if self.shape == "uniform":
            width = self.second - self.first
            return min(1.0, max(0.0, (value - self.first) / width)) if width else float(value >= self.first)
        if self.shape == "lognormal":
            value = math.log(value / self.first) if value > 0 else -math.inf
            return _STANDARD.cdf(value / self.second)
        return _STANDARD.cdf((value - self.first) / self.second)

    def _value(self, share: float) -> float:
        if self.shape == "uniform":
            return self.first + share * (self.second - self.first)
        standard = _STANDARD.inv_cdf(min(1.0 - 1e-12, max(1e-12, share)))
        if self.shape == "lognormal":
            return self.first * math.exp(self.second * standard)
        return self.first + self.second * standard


@dataclass(frozen=True)
class PersonDistribution:
    """Distributions of the values of a person by name, sorted; nobody differs by default.

    Attributes:
        parameters: Name, and distribution of the value.

    Raises:
        ConfigError: A name is unknown, or a value for everybody is out of range.
    """

    parameters: tuple[tuple[str, Distribution], ...] = ()

    def __post_init__(self) -> None:
        for name, _ in self.parameters:
            if name not in _NAMES:
                raise ConfigError(
                    f"a person has no {name!r}; it has {', '.join(RANGES)}, and motion (docs/people.md)"
                )
        self._quantiles({name: 0.5 for name, _ in self.parameters})

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> "PersonDistribution":
        """Distributions as in TOML: name -> number, or a table such as `{"normal": [1.2, 0.2], "min": 0.8}`.

        Raises:
            ConfigError: The description is malformed, or a value is out of range.
        """
        found: dict[str, Distribution] = {}
        for name, value in values.items():
            if name == "motion" and isinstance(value, Mapping):
                found |= {f"motion.{part}": _distribution(f"motion.{part}", v) for part, v in value.items()}
            else:
                found[name] = _distribution(name, value)
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
            return cls.of(tomllib.loads(Path(text).read_text(encoding="utf-8")))
        except OSError as error:
            raise ConfigError(
                f"cannot read {text}: {error.strerror}; name a TOML file, or give values between braces, such as "
                "'{walking_speed = 1.2}'"
            ) from error
        except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
            raise ConfigError(f"{text!r} is not a description of people in TOML: {error}") from error

    def as_dict(self) -> dict[str, Any]:
        """The description, as `of` takes it."""
        return {name: distribution.as_value() for name, distribution in self.parameters}

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
        for name, distribution in self.parameters:
            low, high, _ = RANGES.get(name, (0.0, math.inf, ""))
            try:
                values[name] = distribution.quantile(shares[name], low, high)
            except ConfigError as error:
                raise ConfigError(f"{name}: {error}") from error
        hands = {name.removeprefix("motion."): v for name, v in values.items() if name.startswith("motion.")}
        try:
            if "withdraw_steps" in hands:
                hands["withdraw_steps"] = round(hands["withdraw_steps"])
            motion = PersonParameters().motion._replace(**hands)
            return PersonParameters(motion=motion, **{n: v for n, v in values.items() if n in RANGES})
        except PersonError as error:
            raise ConfigError(str(error)) from error


def _distribution(name: str, given: object) -> Distribution:
    try:
        if not isinstance(given, Mapping):
            return Distribution("constant", _as_float(given))
        shape = next((key for key in given if key in _SHAPES), None)
        if shape is None or not set(given) <= {shape, "min", "max"}:
            raise ConfigError(
                f"give one of {', '.join(_SHAPES)}, with min and max if need be; got {dict(given)}"
            )
        numbers = given[shape]
        if not isinstance(numbers, list | tuple) or len(numbers) != 2:
            raise ConfigError(f"{shape} takes two numbers, got {numbers!r}")
        first, second = map(_as_float, numbers)
        lowest, highest = _as_float(given.get("min", -math.inf)), _as_float(given.get("max", math.inf))
        return Distribution(shape, first, second, lowest, highest)
    except ConfigError as error:
        raise ConfigError(f"{name}: {error}") from error


def _as_float(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ConfigError(f"{value!r} is not a number")
    return float(value)
