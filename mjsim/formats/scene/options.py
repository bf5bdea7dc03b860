"""Options of an import, and what was decided."""

from dataclasses import dataclass

UNITS = {"m": 1.0, "mm": 0.001, "cm": 0.01, "in": 0.0254}  # metres; in the order of guessing
AXES = ("y", "z")


@dataclass(frozen=True)
class ImportOptions:
    """What the user gives; None for what is to be found out."""

    units: str | None = None  # key of `UNITS`
    up: str | None = None  # one of `AXES`
    scale: float = 1.0  # factor on top of the unit
    mass: float | None = None  # kg
    density: float | None = None  # kg/m^3; not with `mass`


@dataclass(frozen=True)
class ImportDecision:
    """One line of the report."""

    what: str  # what was decided
    choice: str  # how
    reason: str = ""  # why, or what to do if it is not what was meant
