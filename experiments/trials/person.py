"""Draw the person of a trial from distributions of the fields of `mjsim.PersonParameters`.

Names and units are the same as in `PersonParameters`. The name of a field in a group has a prefix, for
example `motion.reach_time`. Parameters without a distribution have the same value for all persons.
"""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from experiments.errors import ConfigError
from experiments.participants.distribution import Distributions, Parameter, draw, quantiles
from mjsim.values.errors import PersonError
from mjsim.values.motion_parameters import GROUPS
from mjsim.values.person_parameters import RANGES, PersonParameters

if TYPE_CHECKING:
    import numpy as np

DEFAULT = PersonParameters()
PARAMETERS: Mapping[str, Parameter] = {
    **{name: Parameter(getattr(DEFAULT, name), *RANGES[name]) for name in RANGES},
    **{
        f"{group}.{name}": Parameter(value, 0.0, math.inf, "")
        for group in GROUPS
        for name, value in getattr(DEFAULT, group)._asdict().items()
    },
}


def check_person(described: Distributions) -> None:
    """Check distributions by creating the median person. Raises `ConfigError` if one of them is invalid."""
    if described:
        _person(quantiles(PARAMETERS, described, [0.5] * len(PARAMETERS), "a person"))


def view_limits(text: str) -> tuple[float, float]:
    """Parse the limits of a participant's field of view in radians, such as `1.2,1.9`."""
    least, most, _ = RANGES["field_of_view"]
    try:
        low, high = map(float, text.split(","))
    except ValueError:
        low = high = math.nan
    if not least <= low < high <= most:
        raise ConfigError(
            f"field_of_view_range is {text!r}; it must be two angles joined by a comma, the smaller one first, from "
            f"{least:.4g} to {most:.4g} rad, such as 1.2,1.9"
        )
    return low, high


def drawn_person(described: Distributions, rng: "np.random.Generator") -> PersonParameters:
    """Draw the parameters of a person. Raises `ConfigError` if a name or a distribution is invalid."""
    return _person(draw(PARAMETERS, described, rng, "a person"))


def _person(values: Mapping[str, float]) -> PersonParameters:
    own: dict[str, Any] = {name: values[name] for name in RANGES}
    for group, kind in GROUPS.items():
        numbers: dict[str, Any] = {name: values[f"{group}.{name}"] for name in kind._fields}
        if "withdraw_steps" in numbers:
            numbers["withdraw_steps"] = round(numbers["withdraw_steps"])
        own[group] = kind(**numbers)
    try:
        return PersonParameters(**own)
    except PersonError as error:
        raise ConfigError(str(error)) from error
