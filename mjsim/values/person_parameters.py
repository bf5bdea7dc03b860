"""What differs from person to person: speeds, reach, size, eyes and hands. Every tier of fidelity takes them."""

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

PICTURE_ASPECT = 4 / 3  # width over height of the picture whose whole height a person sees


def _number(default: float, low: float, high: float, unit: str) -> Any:
    """A field with a valid range, both ends included."""
    return field(default=default, metadata={"range": (low, high), "unit": unit})


@dataclass(frozen=True)
class PersonParameters:
    """One person. The world, the planner, the picture and simulated participants all take their numbers from here.

    Where no source is given, a value is this project's choice.

    Example:
        >>> round(PersonParameters(walking_speed=1.0).fastest_walk, 3)
        1.077

    Attributes:
        walking_speed: Usual walk, m/s, at which simulated participants walk; healthy adults walk comfortably at 0.94 to
            1.43 m/s (Bohannon and Williams Andrews, Physiotherapy 97, 2011). `fastest_walk` is 14/13 of it.
        walking_acceleration: How fast the walking velocity changes, m/s^2.
        turning_speed: Fastest turn of the body, rad/s.
        turning_acceleration: How fast the turning rate changes, rad/s^2.
        looking_speed: Fastest pitch of the head while walking, rad/s.
        reach: Farthest that an object's centre or a receptacle's volume may be from the body's axis, horizontally,
            to pick or place, m: an arm's length and a step of bending forward.
        body_radius: Radius of the trunk, m. Planned paths keep 0.05 m more from walls. Houses are sampled for a person
            of the default radius, so that one house serves all.
        eye_height: m; standing adults have it at 1.4 to 1.75 m (Pheasant and Haslegrave, Bodyspace, 2006).
        field_of_view: Horizontal field of view of the picture and of what a participant perceives, rad. Vertically, a
            participant sees what a picture of 4:3 shows; the default is 70 degrees high there.
        viewing_distance: How far away an object is noticed, m.
        looking_interval: Time between two looks for objects while walking, s.
        reading_time: For how long a participant stands and reads the HUD before each visit, s. The default takes no
            time; preparing a step mentally takes 1.35 s (Card, Moran and Newell, CACM 23, 1980), and people read 238
            words a minute (Brysbaert, Journal of Memory and Language 109, 2019).
        patience: For how long a walk may make no progress before the person steps back or looks for another way, s.
        motion: How the hands pick and place.
        carrying: How they carry.
        walking: How a simulated participant walks along a path.

    Raises:
        PersonError: A value is no number of its range.
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
        2.618,  # 150 degrees, as it is printed
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
            object.__setattr__(self, name, float(getattr(self, name)))  # kernels are compiled for one type
        for group in GROUPS:
            object.__setattr__(self, group, _checked(group, getattr(self, group)))

    @property
    def fastest_walk(self) -> float:
        """Fastest walk, m/s: `Move` asks for no more."""
        return self.walking_speed * 14 / 13

    @property
    def vertical_field(self) -> float:
        """Vertical field of view, rad: that of a picture of 4:3."""
        return 2.0 * math.atan(math.tan(self.field_of_view / 2.0) / PICTURE_ASPECT)

    def as_dict(self) -> dict[str, Any]:
        """Every value by name, JSON-ready; those of `GROUPS` under the group's name."""
        values: dict[str, Any] = {name: getattr(self, name) for name in RANGES}
        return values | {group: getattr(self, group)._asdict() for group in GROUPS}

    def unusual(self) -> str:
        """The values that differ from the default person's, in words; empty if none does."""
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
        """The person whose `as_dict` this is.

        Raises:
            PersonError: A name is unknown or missing, or a value is unusable.
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


# Name of every number of a person -> lowest and highest value, and its unit.
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
