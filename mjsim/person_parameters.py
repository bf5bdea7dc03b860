"""What differs from person to person: speeds, reach, size, eyes and hands. Every tier of fidelity takes them."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from mjsim.errors import PersonError

PICTURE_ASPECT = 4 / 3  # width over height of the picture whose whole height a person sees


class MotionParameters(NamedTuple):
    """How the person turns, looks, reaches, lifts, travels with a load, lowers it and withdraws; also for kernels.

    Attributes:
        turn_gain: Yaw rate per heading error while turning to an object or receptacle, 1/s.
        turn_timeout: Longest time that the turn may take, s.
        object_tolerance: Heading error that is good enough for reaching, rad.
        receptacle_tolerance: Heading error that is good enough for placing, rad.
        standing_speed: Slower than this the person stands, m/s.
        standing_turn_rate: Turning slower than this the person stands, rad/s.
        look_gain: Share of a pitch error by which the head moves in one control step.
        look_speed: Fastest pitch of the head during a motion, rad/s.
        reach_time: From the hand's posture to the grip, s.
        align_time: At the grip before the lift, s.
        lift_time: From the floor to the carrying posture, s.
        lead: Share of a reach or lift by which one of its parts (across, up) leads the other.
        start_time: Added to distance over speed for a hand to start and stop, s.
        least_travel: A hand does not travel over less than this, m.
        travel_speed: Speed of a hand that carries a load over a receptacle, m/s.
        descent_speed: Speed of a hand that lowers a load, m/s.
        hover_gap: From a travelling load to whatever it passes over, m.
        hover_time: Above the slot before the descent, s.
        release_gap: From a load to what is below it when the hand opens, m.
        withdraw_steps: Control steps in which the opened hand goes straight up.
        withdraw_step: By how much in each of them, m.
        posture_gain: Speed of a hand on its way to a posture per distance left, 1/s.
        posture_speed: Its fastest, m/s.
        posture_acceleration: How fast that speed changes, m/s^2.
    """

    turn_gain: float = 6.0
    turn_timeout: float = 3.0
    object_tolerance: float = 0.35
    receptacle_tolerance: float = 0.04
    standing_speed: float = 0.1
    standing_turn_rate: float = 0.5
    look_gain: float = 0.25
    look_speed: float = 2.0
    reach_time: float = 0.44
    align_time: float = 0.12
    lift_time: float = 0.64
    lead: float = 0.2
    start_time: float = 0.12
    least_travel: float = 0.005
    travel_speed: float = 0.9
    descent_speed: float = 0.65
    hover_gap: float = 0.03
    hover_time: float = 0.08
    release_gap: float = 0.002
    withdraw_steps: int = 4
    withdraw_step: float = 0.035
    posture_gain: float = 7.0
    posture_speed: float = 1.5
    posture_acceleration: float = 8.0


def _number(default: float, low: float, high: float, unit: str) -> Any:
    """A field with a valid range, both ends included."""
    return field(default=default, metadata={"range": (low, high), "unit": unit})


@dataclass(frozen=True)
class PersonParameters:
    """One person. The world, the planner, the picture and simulated participants all take their numbers from here.

    Where no source is given, a value is this project's choice.

    Attributes:
        walking_speed: Usual walk, m/s, at which simulated participants walk; healthy adults walk comfortably at 0.94 to
            1.43 m/s (Bohannon and Williams Andrews, Physiotherapy 97, 2011). `fastest_walk` is 14/13 of it.
        walking_acceleration: How fast the walking velocity changes, m/s^2; participants plan to brake at half of it.
        turning_speed: Fastest turn of the body, rad/s.
        turning_acceleration: How fast the turning rate changes, rad/s^2.
        looking_speed: Fastest pitch of the head while walking, rad/s.
        reach: Farthest that an object's centre or a receptacle's volume may be from the body's axis, horizontally,
            to pick or place, m: an arm's length and a step of bending forward.
        body_radius: Radius of the trunk, m. Planned paths keep 0.05 m more from walls. Houses are sampled for a person
            of the usual radius, so that one house serves all.
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
        math.radians(150.0),
        "rad",
    )
    viewing_distance: float = _number(8.0, 0.5, 100.0, "m")
    looking_interval: float = _number(0.2, 0.04, 60.0, "s")
    reading_time: float = _number(0.0, 0.0, 60.0, "s")
    patience: float = _number(2.0, 1.0, 60.0, "s")
    motion: MotionParameters = field(default_factory=MotionParameters)

    def __post_init__(self) -> None:
        for name, (low, high, unit) in RANGES.items():
            _check(name, getattr(self, name), low, high, unit)
            object.__setattr__(self, name, float(getattr(self, name)))  # kernels are compiled for one type
        object.__setattr__(self, "motion", _checked(self.motion))

    @property
    def fastest_walk(self) -> float:
        """Fastest walk, m/s: `Move` asks for no more."""
        return self.walking_speed * 14 / 13

    @property
    def vertical_field(self) -> float:
        """Vertical field of view, rad: that of a picture of 4:3."""
        return 2.0 * math.atan(math.tan(self.field_of_view / 2.0) / PICTURE_ASPECT)

    def as_dict(self) -> dict[str, Any]:
        """Every value by name, JSON-ready; those of the hands under `motion`."""
        return {**{name: getattr(self, name) for name in RANGES}, "motion": self.motion._asdict()}

    def unusual(self) -> str:
        """The values that are not the usual person's, in words; empty if all are."""
        usual = PersonParameters()
        others = [
            (name, unit)
            for name, (_, _, unit) in RANGES.items()
            if getattr(self, name) != getattr(usual, name)
        ]
        words = [f"{name.replace('_', ' ')} {getattr(self, name):.4g} {unit}" for name, unit in others]
        hands = self.motion._asdict().items() - usual.motion._asdict().items()
        return ", ".join(
            [*words, *(f"{name.replace('_', ' ')} {value:.4g}" for name, value in sorted(hands))]
        )

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> "PersonParameters":
        """The person whose `as_dict` this is.

        Raises:
            PersonError: A name is unknown or missing, or a value is unusable.
        """
        motion = values.get("motion")
        expected = {*RANGES, "motion"}
        if set(values) != expected or not isinstance(motion, Mapping):
            raise PersonError(f"a person has the values {sorted(expected)}, got {sorted(values)}")
        if set(motion) != set(MotionParameters._fields):
            raise PersonError(f"motion has the values {list(MotionParameters._fields)}, got {sorted(motion)}")
        return cls(**{**values, "motion": MotionParameters(**motion)})


# Whoever picks or places is done within 30 s.
_MOTION_RANGES = {
    "turn_timeout": (0.04, 4.0),
    "look_gain": (0.01, 1.0),
    "reach_time": (0.1, 3.0),
    "align_time": (0.0, 2.0),
    "lift_time": (0.1, 3.0),
    "lead": (0.0, 0.9),
    "start_time": (0.0, 1.0),
    "travel_speed": (0.25, 5.0),
    "descent_speed": (0.25, 5.0),
    "hover_gap": (0.0, 0.3),
    "hover_time": (0.0, 2.0),
    "release_gap": (0.0, 0.1),
    "withdraw_steps": (1, 20),
    "withdraw_step": (0.001, 0.1),
    "posture_gain": (1.0, 50.0),
    "posture_speed": (0.2, 10.0),
    "posture_acceleration": (1.0, 100.0),
}

# Name of every number of a person -> lowest and highest value, and its unit.
RANGES: dict[str, tuple[float, float, str]] = {
    f.name: (*f.metadata["range"], f.metadata["unit"])
    for f in dataclasses.fields(PersonParameters)
    if f.metadata
}


def _check(name: str, value: object, low: float, high: float, unit: str) -> None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        said = f"{name} must be {low:.4g} to {high:.4g} {unit}, got {value!r}"
        if unit.startswith("rad") and isinstance(value, int | float) and low <= math.radians(value) <= high:
            said += f"; {value:g} degrees are {math.radians(value):.4g} rad"
        raise PersonError(said)


def _checked(motion: MotionParameters) -> MotionParameters:
    for name, value in motion._asdict().items():
        _check(f"motion.{name}", value, *_MOTION_RANGES.get(name, (1e-4, 10.0)), "in SI units")
    if motion.withdraw_steps != int(motion.withdraw_steps):
        raise PersonError(f"motion.withdraw_steps must be a whole number, got {motion.withdraw_steps!r}")
    numbers: dict[str, Any] = {name: float(value) for name, value in motion._asdict().items()}
    return MotionParameters(**{**numbers, "withdraw_steps": int(motion.withdraw_steps)})
