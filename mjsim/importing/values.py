"""What a user says about a mesh file, and what was decided about it."""

from dataclasses import dataclass

UNITS = {"m": 1.0, "mm": 0.001, "cm": 0.01, "in": 0.0254}  # metres; in the order of guessing
AXES = ("y", "z")


@dataclass(frozen=True)
class ImportOptions:
    """What the user says about a mesh; None where it is to be found.

    Attributes:
        units: Key of `UNITS`.
        up: One of `AXES`.
        scale: Factor on top of the unit.
        mass: kg.
        density: kg/m^3; not with `mass`.
    """

    units: str | None = None
    up: str | None = None
    scale: float = 1.0
    mass: float | None = None
    density: float | None = None


@dataclass(frozen=True)
class Decision:
    """One line of the report.

    Attributes:
        what: What was decided.
        choice: How.
        reason: Why, or what to do if it is not what was meant.
    """

    what: str
    choice: str
    reason: str = ""
