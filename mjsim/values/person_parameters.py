"""Parameters of a person, such as walking speed, reach and eye height."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mjsim.values.errors import PersonError
from mjsim.values.motion_parameters import (
    GROUP_RANGES,
    GROUPS,
    CarryingParameters,
    MotionParameters,
    WalkingParameters,
)

PICTURE_ASPECT = 4 / 3  # width divided by height of the picture that fills the field of view


def _number(default: float, low: float, high: float, unit: str) -> Any:
    return field(default=default, metadata={"range": (low, high), "unit": unit})


@dataclass(frozen=True)
class PersonParameters:
    """Parameters of a person, used by the simulator, planner, renderer and simulated participants.

    Values without a cited source were chosen for this project.

    Example:
        >>> round(PersonParameters(walking_speed=1.0).fastest_walk, 3)
        1.077

    Attributes:
        walking_speed: Walking speed of simulated participants, in m/s. Healthy adults prefer 0.94 to 1.43
            m/s (Bohannon and Williams Andrews, Physiotherapy 97, 2011). `fastest_walk` is 14/13 of it.
        walking_acceleration: Maximum acceleration while walking, in m/s^2.
        turning_speed: Maximum yaw rate of the body, in rad/s.
        turning_acceleration: Maximum angular acceleration of the body, in rad/s^2.
        looking_speed: Maximum pitch rate of the head while walking, in rad/s.
        reach: Maximum horizontal distance at which the person can pick or place, in metres. It is measured
            from the body axis to the object's centre or the receptacle's volume, and allows for bending with
            an outstretched arm.
        body_radius: Radius of the trunk, in metres. Planned paths keep an additional distance of 0.05 m from
            walls. Houses are sampled for the default radius, so that all participants can use the same house.
        eye_height: Height of the eyes, in metres. Typical values for standing adults are 1.4 to 1.75 m
            (Pheasant and Haslegrave, Bodyspace, 2006).
        field_of_view: Horizontal field of view of pictures and of perception, in radians. Vertically, a participant
            sees what a 4:3 picture shows, which is 70 degrees by default.
        viewing_distance: Maximum distance at which a participant notices an object, in metres.
        looking_interval: Time between checks for visible objects while walking, in seconds.
        reading_time: Time that a participant spends reading the HUD before each visit, in seconds. The
            default is 0. Mental preparation for a step takes 1.35 s (Card, Moran and Newell, CACM 23, 1980),
            and people read 238 words per minute (Brysbaert, Journal of Memory and Language 109, 2019).
        patience: Time without progress after which a walking person steps back or looks for another way, in seconds.
        motion: Parameters for picking and placing.
        carrying: Parameters for carrying objects.
        walking: Parameters for walking along a path.

    Raises:
        PersonError: A value is not a number, or is out of range.
    """

    walking_speed: float = _number(1.3, 0.1, 8.0, "m/s")
    walking_acceleration: float = _number(3.0, 0.5, 20.0, "m/s^2")
    turning_speed: float = _number(2.5, 0.5, 10.0, "rad/s")
    turning_acceleration: float = _number(15.0, 1.0, 60.0, "rad/s^2")
    looking_speed: float = _number(1.5, 0.1, 10.0, "rad/s")
    reach: float = _number(1.0, 0.6, 1.5, "m")
    body_radius: float = _number(0.20, 0.10, 0.25, "m")
    eye_height: float = _number(1.60, 1.0, 2.0, "m")
    field_of_view: float = _number(
        2.0 * math.atan(PICTURE_ASPECT * math.tan(math.radians(35.0))),
        math.radians(20.0),
        2.618,  # 150 degrees
        "rad",
    )
    viewing_distance: float = _number(8.0, 0.5, 100.0, "m")
    looking_interval: float = _number(0.2, 0.04, 60.0, "s")
    reading_time: float = _number(0.0, 0.0, 60.0, "s")
    patience: float = _number(2.0, 1.0, 60.0, "s")
    motion: MotionParameters = field(default_factory=MotionParameters)
    carrying: CarryingParameters = field(default_factory=CarryingParameters)
    walking: WalkingParameters = field(default_factory=WalkingParameters)

    def __post_init__(self) -> None:
        for name, (low, high, unit) in RANGES.items():
            _check(name, getattr(self, name), low, high, unit)
            object.__setattr__(self, name, float(getattr(self, name)))  # compiled kernels accept only floats
        for group in GROUPS:
            object.__setattr__(self, group, _checked(group, getattr(self, group)))

    @property
    def fastest_walk(self) -> float:
        """The maximum walking speed of a `Move`, in m/s."""
        return self.walking_speed * 14 / 13

    @property
    def vertical_field(self) -> float:
        """The vertical field of view of a 4:3 picture, in radians."""
        return 2.0 * math.atan(math.tan(self.field_of_view / 2.0) / PICTURE_ASPECT)

    def as_dict(self) -> dict[str, Any]:
        """Return all parameters as a JSON-serializable dictionary, with groups as nested dictionaries."""
        values: dict[str, Any] = {name: getattr(self, name) for name in RANGES}
        return values | {group: getattr(self, group)._asdict() for group in GROUPS}

    def unusual(self) -> str:
        """Describe all parameters that differ from their defaults, or return an empty string."""
        default = PersonParameters()
        others = [
            (name, unit)
            for name, (_, _, unit) in RANGES.items()
            if getattr(self, name) != getattr(default, name)
        ]
        words = [f"{name.replace('_', ' ')} {getattr(self, name):.4g} {unit}" for name, unit in others]
        for group in GROUPS:
            changed = getattr(self, group)._asdict().items() - getattr(default, group)._asdict().items()
            words += [f"{name.replace('_', ' ')} {value:.4g}" for name, value in sorted(changed)]
        return ", ".join(words)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "PersonParameters":
        """Create parameters from the output of `as_dict`.

        Raises:
            PersonError: A name is unknown or missing, or a value is invalid.
        """
        expected = {*RANGES, *GROUPS}
        if set(values) != expected:
            raise PersonError(f"a person has the values {sorted(expected)}, got {sorted(values)}")
        groups: dict[str, Any] = {}
        for name, group in GROUPS.items():
            found = values[name]
            if not isinstance(found, Mapping) or set(found) != set(group._fields):
                raise PersonError(f"{name} has the values {list(group._fields)}, got {found!r}")
            groups[name] = group(**found)
        return cls(**{**values, **groups})


# Minimum, maximum and unit of each parameter.
RANGES: dict[str, tuple[float, float, str]] = {
    f.name: (*f.metadata["range"], f.metadata["unit"])
    for f in dataclasses.fields(PersonParameters)
    if f.metadata
}


def _check(name: str, value: object, low: float, high: float, unit: str) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        message = f"{name} must be {low:.4g} to {high:.4g} {unit}, got {value!r}"
        if unit.startswith("rad") and isinstance(value, int | float) and low <= math.radians(value) <= high:
            message += f"; {value:g} degrees are {math.radians(value):.4g} rad"
        raise PersonError(message)


def _checked(group: str, values: Any) -> Any:
    for name, value in values._asdict().items():
        _check(f"{group}.{name}", value, *GROUP_RANGES.get(f"{group}.{name}", (1e-4, 10.0)), "in SI units")
    numbers: dict[str, Any] = {name: float(value) for name, value in values._asdict().items()}
    if "withdraw_steps" in numbers:
        if not numbers["withdraw_steps"].is_integer():
            raise PersonError(f"motion.withdraw_steps must be a whole number, got {values.withdraw_steps!r}")
        numbers["withdraw_steps"] = int(numbers["withdraw_steps"])
    return type(values)(**numbers)
