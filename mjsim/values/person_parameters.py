"""Parameters of a person: speeds, reach, size, eyes and hands."""

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

PICTURE_ASPECT = 4 / 3  # aspect ratio (width over height) of the picture that fills a person's field of view


def _number(default: float, low: float, high: float, unit: str) -> Any:
    return field(default=default, metadata={"range": (low, high), "unit": unit})


@dataclass(frozen=True)
class PersonParameters:
    """Parameters of one person, used by the world, the planner, the renderer and simulated participants.

    Values without a source are choices of this project.

    Example:
        >>> round(PersonParameters(walking_speed=1.0).fastest_walk, 3)
        1.077

    Attributes:
        walking_speed: Speed at which simulated participants walk, in m/s. Healthy adults prefer 0.94 to 1.43
            m/s (Bohannon and Williams Andrews, Physiotherapy 97, 2011). `fastest_walk` is 14/13 of it.
        walking_acceleration: Limit of the walking acceleration, in m/s^2.
        turning_speed: Maximum yaw rate of the body, in rad/s.
        turning_acceleration: Limit of the angular acceleration of the body, in rad/s^2.
        looking_speed: Maximum pitch rate of the head while walking, in rad/s.
        reach: Maximum horizontal distance from the body's axis to an object's centre or a receptacle's volume for
            picking or placing, in metres. It allows for bending forward with an outstretched arm.
        body_radius: Radius of the trunk, in metres. Planned paths keep an additional 0.05 m from walls. Houses are
            sampled for the default radius, so that all participants can use the same house.
        eye_height: Height of the eyes, in metres. Those of standing adults are at 1.4 to 1.75 m (Pheasant and
            Haslegrave, Bodyspace, 2006).
        field_of_view: Horizontal field of view of pictures and of perception, in radians. Vertically, a participant
            sees what a 4:3 picture shows, which is 70 degrees by default.
        viewing_distance: Maximum distance at which an object is noticed, in metres.
        looking_interval: Time between checks for visible objects while walking, in seconds.
        reading_time: Time for which a participant stands and reads the HUD before each visit, in seconds. By default 0.
            The mental preparation of a step requires 1.35 s (Card, Moran and Newell, CACM 23, 1980), and people read
            238 words per minute (Brysbaert, Journal of Memory and Language 109, 2019).
        patience: Time without progress after which a walking person steps back or looks for another way, in seconds.
        motion: Parameters of picking and placing.
        carrying: Parameters of carrying.
        walking: Parameters of simulated participants' walking.

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
            object.__setattr__(self, name, float(getattr(self, name)))  # kernels accept only floats
        for group in GROUPS:
            object.__setattr__(self, group, _checked(group, getattr(self, group)))

    @property
    def fastest_walk(self) -> float:
        """Walking speed limit of `Move`, in m/s."""
        return self.walking_speed * 14 / 13

    @property
    def vertical_field(self) -> float:
        """Vertical field of view of a 4:3 picture, in radians."""
        return 2.0 * math.atan(math.tan(self.field_of_view / 2.0) / PICTURE_ASPECT)

    def as_dict(self) -> dict[str, Any]:
        """Return all parameters as JSON-serializable values, with a nested table for each group."""
        values: dict[str, Any] = {name: getattr(self, name) for name in RANGES}
        return values | {group: getattr(self, group)._asdict() for group in GROUPS}

    def unusual(self) -> str:
        """Describe the parameters that differ from the defaults. Return an empty text if there are none."""
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


# Lowest value, highest value and unit of each parameter.
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
