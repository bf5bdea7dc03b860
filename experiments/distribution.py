"""Distributions of one number over people, as TOML describes them and as a random number draws from them.

walking_speed = {normal = [1.2, 0.2], min = 0.8}    # mean and standard deviation
reading_time = {lognormal = [1.35, 0.35]}           # median, and standard deviation of the logarithm
reach = {uniform = [0.8, 1.1]}                      # lowest and highest
lapse = {beta = [0.5, 3]}                           # both shape parameters, from 0 to 1
follows = {mixture = [[0.6, 1.0], [0.4, {beta = [2, 2]}]]}   # kinds of people: weight, distribution
field_of_view = 1.2                                 # the same for everybody
"""

import math
import statistics
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from experiments.errors import ConfigError

_STANDARD = statistics.NormalDist()
SHAPES = ("normal", "lognormal", "uniform", "beta")
MIXTURE = "mixture"
_LIMITS = ("min", "max")


@dataclass(frozen=True)
class Distribution:
    """Distribution of one number.

    Attributes:
        shape: `constant`, `normal`, `lognormal`, `uniform` or `beta`.
        first: The value, the mean, the median, the lowest value, or the first shape parameter.
        second: Nothing, the standard deviation, that of the logarithm, the highest value, or the second parameter.
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
        if self.shape == "beta" and not min(numbers) > 0:
            raise ConfigError(f"the parameters of beta must be positive, got {numbers}")
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
        if self.shape == "beta":
            from scipy.special import betainc  # only who needs it waits for it

            return float(betainc(self.first, self.second, min(1.0, max(0.0, value))))
        if self.shape == "lognormal":
            value = math.log(value / self.first) if value > 0 else -math.inf
            return _STANDARD.cdf(value / self.second)
        return _STANDARD.cdf((value - self.first) / self.second)

    def _value(self, share: float) -> float:
        if self.shape == "uniform":
            return self.first + share * (self.second - self.first)
        if self.shape == "beta":
            from scipy.special import betaincinv

            return float(betaincinv(self.first, self.second, share))
        standard = _STANDARD.inv_cdf(min(1.0 - 1e-12, max(1e-12, share)))
        if self.shape == "lognormal":
            return self.first * math.exp(self.second * standard)
        return self.first + self.second * standard


@dataclass(frozen=True)
class Mixture:
    """Several kinds of people, each with a distribution of its own.

    Attributes:
        kinds: Weight of each kind, and its distribution.

    Raises:
        ConfigError: There is no kind, or a weight is negative or not finite, or none is positive.
    """

    kinds: tuple[tuple[float, Distribution], ...]

    def __post_init__(self) -> None:
        weights = [weight for weight, _ in self.kinds]
        if not all(0 <= w < math.inf for w in weights) or not sum(weights) > 0:
            raise ConfigError(
                f"the weights of a mixture must not be negative, and one positive; got {weights}"
            )

    def as_value(self) -> dict[str, Any]:
        """The description, as in TOML."""
        return {MIXTURE: [[weight, kind.as_value()] for weight, kind in self.kinds]}

    def quantile(self, share: float, lowest: float, highest: float) -> float:
        """A value for a random number from 0 to 1: it says which kind, and then which value of that kind.

        Raises:
            ConfigError: As good as nothing of that kind lies between the two values.
        """
        kinds = [(weight, kind) for weight, kind in self.kinds if weight > 0]
        left = share * sum(weight for weight, _ in kinds)
        for weight, kind in kinds[:-1]:
            if left < weight:
                return kind.quantile(left / weight, lowest, highest)
            left -= weight
        weight, kind = kinds[-1]
        return kind.quantile(min(1.0, max(0.0, left / weight)), lowest, highest)


AnyDistribution = Distribution | Mixture


def is_distribution(given: object) -> bool:
    """Whether a value of a TOML table describes a distribution, and is not a table of several."""
    return not isinstance(given, Mapping) or any(name in given for name in (*SHAPES, MIXTURE, *_LIMITS))


def distribution(name: str, given: object) -> AnyDistribution:
    """The distribution that a number or a table such as `{"normal": [1.2, 0.2], "min": 0.8}` describes.

    Raises:
        ConfigError: It describes none; the message begins with `name`.
    """
    try:
        if isinstance(given, Mapping) and MIXTURE in given:
            return _mixture(given)
        return _simple(given)
    except ConfigError as error:
        raise ConfigError(f"{name}: {error}") from error


def _simple(given: object) -> Distribution:
    if not isinstance(given, Mapping):
        return Distribution("constant", _as_float(given))
    shape = next((key for key in given if key in SHAPES), None)
    if shape is None or not set(given) <= {shape, *_LIMITS}:
        raise ConfigError(
            f"give one of {', '.join(SHAPES)}, with min and max if need be, or mixture; got {dict(given)}"
        )
    numbers = given[shape]
    if not isinstance(numbers, list | tuple) or len(numbers) != 2:
        raise ConfigError(f"{shape} takes two numbers, got {numbers!r}")
    first, second = map(_as_float, numbers)
    lowest, highest = _as_float(given.get("min", -math.inf)), _as_float(given.get("max", math.inf))
    return Distribution(shape, first, second, lowest, highest)


def _mixture(given: Mapping[str, Any]) -> Mixture:
    pairs = given[MIXTURE]
    well_formed = isinstance(pairs, list | tuple) and all(
        isinstance(pair, list | tuple) and len(pair) == 2 for pair in pairs
    )
    if len(given) > 1 or not well_formed:
        raise ConfigError(f"mixture takes pairs of a weight and a distribution, got {dict(given)}")
    return Mixture(tuple((_as_float(weight), _simple(kind)) for weight, kind in pairs))


def _as_float(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ConfigError(f"{value!r} is not a number")
    return float(value)
