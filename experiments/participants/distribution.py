"""Distributions of parameter values over participants. Examples in TOML:

walking_speed = {normal = [1.2, 0.2], min = 0.8}    # mean and standard deviation
reading_time = {lognormal = [1.35, 0.35]}           # median, and standard deviation of the logarithm
reach = {uniform = [0.8, 1.1]}                      # lowest and highest value
lapse = {beta = [0.5, 3]}                           # both shape parameters; values from 0 to 1
follows = {mixture = [[0.6, 1.0], [0.4, {beta = [2, 2]}]]}   # weight and distribution of each group
field_of_view = 1.2                                 # the same value for each participant
"""

import functools
import math
import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import msgspec

from experiments.errors import ConfigError, shown
from mjsim.support.toml import TomlError, parse_toml, read_toml

if TYPE_CHECKING:
    import numpy as np

SHAPES = ("constant", "normal", "lognormal", "uniform", "beta", "mixture")
_STANDARD = statistics.NormalDist()

_Pair = tuple[float, float]
_NonNegative = Annotated[float, msgspec.Meta(ge=0)]


class Distribution(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A distribution of a number, truncated at `min` and `max`.

    Raises:
        ConfigError: There is no shape or more than one, a number is invalid, or `min` is larger than `max`.
    """

    constant: float | None = None  # the same value for each participant
    normal: _Pair | None = None  # mean and standard deviation
    lognormal: _Pair | None = None  # median, and standard deviation of the logarithm
    uniform: _Pair | None = None  # lowest and highest value
    beta: _Pair | None = None  # both shape parameters
    # for each group of participants, its weight and a number or distribution
    mixture: "tuple[tuple[_NonNegative, float | Distribution], ...] | None" = None
    min: float = -math.inf
    max: float = math.inf

    def __post_init__(self) -> None:
        if len([name for name in SHAPES if getattr(self, name) is not None]) != 1:
            raise ConfigError(f"give a number, or one of {', '.join(SHAPES[1:])}")
        numbers = self._numbers
        if not all(map(math.isfinite, numbers)) or math.isnan(self.min) or math.isnan(self.max):
            raise ConfigError(f"{', '.join(f'{n:g}' for n in numbers)}: every number must be finite")
        if self.uniform is not None and not numbers[0] <= numbers[1]:
            raise ConfigError(f"uniform takes the lowest value, then the highest; got {numbers}")
        if self.shape in ("normal", "lognormal") and not numbers[1] > 0:
            raise ConfigError(f"the standard deviation of {self.shape} must be positive, got {numbers[1]}")
        if self.lognormal is not None and not numbers[0] > 0:
            raise ConfigError(f"the median of lognormal must be positive, got {numbers[0]}")
        if self.beta is not None and not min(numbers) > 0:
            raise ConfigError(f"the parameters of beta must be positive, got {numbers}")
        if self.mixture is not None and not sum(numbers) > 0:
            raise ConfigError(f"one weight of a mixture must be positive, got {numbers}")
        if not self.min <= self.max:
            raise ConfigError(f"min must not exceed max, got {self.min} and {self.max}")

    @property
    def shape(self) -> str:
        """Name of the distribution's shape, one of `SHAPES`."""
        return next(name for name in SHAPES if getattr(self, name) is not None)

    @property
    def _numbers(self) -> list[float]:
        if self.constant is not None:
            return [self.constant]
        if self.mixture is not None:
            return [weight for weight, _ in self.mixture]
        return list(getattr(self, self.shape))

    def as_value(self) -> Any:
        """Return the TOML value that describes the distribution."""
        if self.constant is not None:
            return self.constant
        kinds = [[w, k.as_value() if isinstance(k, Distribution) else k] for w, k in self.mixture or ()]
        limits = {name: limit for name in ("min", "max") if math.isfinite(limit := getattr(self, name))}
        return {self.shape: kinds or self._numbers, **limits}

    def quantile(self, share: float, lowest: float = -math.inf, highest: float = math.inf) -> float:
        """Return the quantile at `share` (0 to 1) of the distribution, truncated to [`lowest`, `highest`].

        In a mixture, the share selects both a component and a value of that component.
        """
        if self.constant is not None:
            return self.constant
        if self.mixture is not None:
            kind, share = self._kind(share)
            return kind.quantile(share, lowest, highest) if isinstance(kind, Distribution) else kind
        low, high = max(self.min, lowest), min(self.max, highest)
        below, above = self._share_below(low), self._share_below(high)
        if not low <= high or not above - below > 1e-6:
            raise ConfigError(f"{self.shape} = {self._numbers} has no values from {low:.4g} to {high:.4g}")
        return min(high, max(low, self._value(below + share * (above - below))))

    def _kind(self, share: float) -> "tuple[float | Distribution, float]":
        """Return the mixture component at a quantile (0 to 1), and the quantile within this component."""
        kinds = [(weight, kind) for weight, kind in self.mixture or () if weight > 0]
        left = share * sum(weight for weight, _ in kinds)
        for weight, kind in kinds[:-1]:
            if left < weight:
                return kind, left / weight
            left -= weight
        weight, kind = kinds[-1]
        return kind, min(1.0, max(0.0, left / weight))

    def _share_below(self, value: float) -> float:
        first, second = self._numbers
        if self.uniform is not None:
            width = second - first
            return min(1.0, max(0.0, (value - first) / width)) if width else float(value >= first)
        if self.beta is not None:
            from scipy.special import betainc  # imported here because SciPy is slow to import

            return float(betainc(first, second, min(1.0, max(0.0, value))))
        if self.lognormal is not None:
            return _STANDARD.cdf((math.log(value / first) if value > 0 else -math.inf) / second)
        return _STANDARD.cdf((value - first) / second)

    def _value(self, share: float) -> float:
        first, second = self._numbers
        if self.uniform is not None:
            return first + share * (second - first)
        if self.beta is not None:
            from scipy.special import betaincinv

            return float(betaincinv(first, second, share))
        standard = _STANDARD.inv_cdf(min(1.0 - 1e-12, max(1e-12, share)))
        return (
            first * math.exp(second * standard) if self.lognormal is not None else first + second * standard
        )


def distribution(name: str, given: object) -> Distribution:
    """Convert a number, or a table such as `{"normal": [1.2, 0.2], "min": 0.8}`, to a distribution."""
    try:
        return converted(given)
    except (msgspec.ValidationError, ConfigError) as error:
        raise ConfigError(f"{name}: {error}") from error


def converted(given: object) -> Distribution:
    """Convert a number or table to a distribution. Raise ConfigError or ValidationError if it is invalid."""
    if isinstance(given, Mapping):
        return msgspec.convert(given, Distribution)
    return Distribution(constant=msgspec.convert(given, float))


class Distributions(Mapping[str, Distribution]):
    """A mapping from parameter names, such as `walking_speed` or `motion.reach_time`, to distributions."""

    def __init__(self, values: Mapping[str, Distribution] | None = None) -> None:
        self._values = dict(sorted((values or {}).items()))

    @classmethod
    def of(cls, values: Mapping[str, Any]) -> "Distributions":
        """Create distributions from a TOML table. A subtable such as `[compliance]` is a parameter group."""
        if not isinstance(values, Mapping):
            raise ConfigError(f"{shown(values)} is not a table of values such as {{ walking_speed = 1.2 }}")
        found: dict[str, Distribution] = {}
        for name, value in values.items():
            if value == {}:
                raise ConfigError(f"{name} is an empty table; give its values, or leave it out")
            if isinstance(value, Mapping) and set(value).isdisjoint(Distribution.__struct_fields__):
                found |= {f"{name}.{part}": distribution(f"{name}.{part}", v) for part, v in value.items()}
            else:
                found[name] = distribution(name, value)
        return cls(found)

    @classmethod
    def parse(cls, text: str) -> "Distributions":
        """Read distributions from an inline TOML table or a TOML file. Raises ConfigError if this fails."""
        try:
            if text.lstrip().startswith("{"):
                return cls.of(parse_toml(f"person = {text}")["person"])
            return cls.of(read_toml(Path(text)))
        except OSError as error:
            raise ConfigError(
                f"cannot read {text}: {error.strerror}; name a TOML file, or give values between braces, such as "
                "'{walking_speed = 1.2}'"
            ) from error
        except TomlError as error:
            raise ConfigError(f"{text!r} is not a description of people in TOML: {error}") from error

    def as_dict(self) -> dict[str, Any]:
        """Return a table from which `of` creates the same distributions."""
        return {name: described.as_value() for name, described in self.items()}

    def updated(self, other: "Distributions") -> "Distributions":
        """Return a copy with the distributions of `other`, which replace those of the same name."""
        return Distributions({**self, **other})

    def __getitem__(self, name: str) -> Distribution:
        return self._values[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __hash__(self) -> int:
        return hash(tuple(self._values.items()))

    def __repr__(self) -> str:
        return f"Distributions({self.as_dict()})"


@dataclass(frozen=True)
class Parameter:
    """A parameter that differs between participants."""

    usual: float | Mapping[str, Any]  # default distribution as a TOML value
    lowest: float  # smallest valid value
    highest: float  # largest valid value
    unit: str  # unit of the values, empty for plain numbers, `probability` for 0 to 1

    @functools.cached_property
    def spread(self) -> Distribution:
        """The default distribution."""
        return converted(self.usual)

    def check(self, name: str, value: float) -> None:
        """Raise a ConfigError if `value` is out of range."""
        if not self.lowest <= value <= self.highest:
            bounds = f"{self.lowest:.4g} to {self.highest:.4g} {self.unit}".rstrip()
            raise ConfigError(f"{name} must be {bounds}, got {value:.4g}")


def draw(
    parameters: Mapping[str, Parameter], described: Distributions, rng: "np.random.Generator", of: str
) -> dict[str, float]:
    """Draw a participant's parameter values, by name.

    Each value depends only on its own random number. `described` overrides default distributions. `of` names
    the owner of the parameters in error messages.
    """
    return quantiles(parameters, described, rng.random(len(parameters)).tolist(), of)


def quantiles(
    parameters: Mapping[str, Parameter], described: Distributions, shares: Sequence[float], of: str
) -> dict[str, float]:
    """Return a participant's parameter values by name. Each share selects the quantile of a distribution."""
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
    """Declare a dataclass field whose value differs between participants."""
    return field(metadata={"parameter": Parameter(usual, lowest, highest, unit)})


def chance(usual: float | Mapping[str, Any]) -> Any:
    """Declare a dataclass field for a probability that differs between participants."""
    return varies(usual, 0.0, 1.0, "probability")
