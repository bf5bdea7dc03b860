"""Determine the unit and the vertical axis of a mesh file."""

from dataclasses import dataclass

import numpy as np

from mjsim.formats.scene.source_scene import UNITS
from mjsim.formats.scene.surface import Floats
from mjsim.house.validation.object_rules import SIZE
from mjsim.values.errors import AssetError

MIN_SIDE, MAX_SIDE = SIZE
_Y_UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


@dataclass(frozen=True)
class Scaling:
    """Converts the coordinates of a mesh file to metres, with the z axis up."""

    unit: str  # unit of length in the file, which is a key of `UNITS`
    up: str  # vertical axis in the file, `y` or `z`
    factor: float  # number of metres per unit of the file, including `--scale`
    unit_reason: str
    up_reason: str

    @property
    def transform(self) -> Floats:
        """The homogeneous transform (4, 4) from the coordinates in the file to metres, with the z axis up."""
        scale = np.diag([self.factor, self.factor, self.factor, 1.0])
        return np.asarray(_Y_UP @ scale if self.up == "y" else scale)


def scaling(suffix: str, longest: float, *, units: str | None, up: str | None, scale: float) -> Scaling:
    """Determine the unit and vertical axis of a file from its suffix and longest side, unless they are given.

    Raise an AssetError if no unit gives a size that a hand can carry.
    """
    unit, unit_reason = (units, "given") if units else _unit(suffix, longest * scale)
    size = longest * scale * UNITS[unit]
    if not MIN_SIDE <= size <= MAX_SIDE:
        raise AssetError(_advice(longest * scale, unit, unit_reason))
    axis, up_reason = (up, "given") if up else _axis(suffix)
    return Scaling(unit, axis, scale * UNITS[unit], unit_reason, up_reason)


def _unit(suffix: str, longest: float) -> tuple[str, str]:
    if suffix == ".glb":
        return "m", "glTF is in metres"
    fitting = [unit for unit, metres in UNITS.items() if MIN_SIDE <= longest * metres <= MAX_SIDE]
    if not fitting:
        return "m", "no unit fits"
    others = "".join(f"; if it is {o}, use --units {o}" for o in fitting[1:])
    return fitting[0], f"guessed from the size: the longest side is {longest:.4g} {fitting[0]}{others}"


def _axis(suffix: str) -> tuple[str, str]:
    if suffix == ".glb":
        return "y", "glTF has y up"
    if suffix == ".obj":
        return "y", "guessed: most programs write OBJ with y up; if not, use --up z"
    return "z", f"guessed: most {suffix[1:].upper()} files have z up; if not, use --up y"


def _advice(longest: float, unit: str, reason: str) -> str:
    limits = f"a hand carries {MIN_SIDE:g} to {MAX_SIDE:g} m"
    as_unit = "in any unit" if reason == "no unit fits" else f"in {unit} ({reason})"
    size = f"its longest side is {longest:.4g}, which {as_unit} is too {{}}: {limits}"
    size = size.format("small" if longest * UNITS[unit] < MIN_SIDE else "large")
    fitting = [u for u, metres in UNITS.items() if u != unit and MIN_SIDE <= longest * metres <= MAX_SIDE]
    remedy = f"if it is in {' or '.join(fitting)}, use --units {fitting[0]}; else " if fitting else ""
    return f"{size}; {remedy}use --scale {0.2 / (longest * UNITS[unit]):.2g} for a length of 0.2 m"
