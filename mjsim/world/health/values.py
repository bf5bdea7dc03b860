"""The health of the physics as values; `docs/health.md` defines every term."""

import math
from dataclasses import dataclass
from typing import NamedTuple

Pair = tuple[float, float]

NOTHING: Pair = (math.nan, math.nan)


class HealthSample(NamedTuple):
    """The physics at the end of one control step.

    Attributes:
        penetration_m: Deepest overlap of an object with anything but the person, m. The person's foot is left out
            because it is soft on purpose: it pushes and never launches.
        trunk_penetration_m: Deepest overlap of the person's trunk with the house, m.
        weld_error_m: Distance between each hand and the grip that it carries, m; NaN where it carries nothing.
        weld_error_rad: Angle between each hand and the grip that it carries, rad; NaN where it carries nothing.
        settle_s: Time from release to rest of an object that has come to rest in this step, the longest if there
            are several, s; NaN if there is none.
    """

    penetration_m: float = 0.0
    trunk_penetration_m: float = 0.0
    weld_error_m: Pair = NOTHING
    weld_error_rad: Pair = NOTHING
    settle_s: float = math.nan

    @property
    def row(self) -> tuple[float, ...]:
        """Seven numbers in the order of the attributes, left hand before right."""
        overlaps = (self.penetration_m, self.trunk_penetration_m)
        return (*overlaps, *self.weld_error_m, *self.weld_error_rad, self.settle_s)


@dataclass(frozen=True)
class Health:
    """Extremes and counts since the last reset.

    Attributes:
        max_penetration_m: Largest `HealthSample.penetration_m`.
        max_trunk_penetration_m: Largest `HealthSample.trunk_penetration_m`.
        max_weld_error_m: Largest `HealthSample.weld_error_m`; 0 if nothing was carried.
        max_weld_error_rad: Largest `HealthSample.weld_error_rad`; 0 if nothing was carried.
        settle_times: Seconds from each release to rest, in order.
        ejections: Objects that flew off, out of the house, or faster than anything can fall or be kicked.
        tunnellings: Objects that passed through something solid.
        warnings: Number of MuJoCo warnings; any one ends the simulation with a `PhysicsError`.
    """

    max_penetration_m: float = 0.0
    max_trunk_penetration_m: float = 0.0
    max_weld_error_m: float = 0.0
    max_weld_error_rad: float = 0.0
    settle_times: tuple[float, ...] = ()
    ejections: int = 0
    tunnellings: int = 0
    warnings: int = 0


QUIET = HealthSample()
