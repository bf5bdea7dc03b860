"""Determine the unit and the vertical axis of a mesh file."""

import math
from dataclasses import dataclass, replace

import numpy as np
import trimesh
from scipy.spatial import QhullError

from mjsim.formats.scene.source_scene import AXES, UNITS
from mjsim.formats.scene.surface import Floats
from mjsim.house.validation.object_rules import SIZE
from mjsim.importing.object.resting import STEADY, tilt
from mjsim.values.errors import AssetError

MIN_SIDE, MAX_SIDE = SIZE
_Y_UP = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
_UNIT = {"y": np.array([0.0, 1.0, 0.0]), "z": np.array([0.0, 0.0, 1.0])}
_CLEARLY = math.radians(10.0)  # difference of tilt angles above which a pose is clearly more stable
_BASE = 0.02  # maximum distance of the base from the origin, relative to the height of the object


@dataclass(frozen=True)
class Scaling:
    """The unit and the vertical axis of a mesh file."""

    unit: str  # unit of length in the file, which is a key of `UNITS`
    up: str  # vertical axis in the file, `y` or `z`
    factor: float  # number of metres per unit of the file, including `--scale`
    unit_reason: str
    up_reason: str

    @property
    def upright(self) -> Floats:
        """The homogeneous transform (4, 4) from the axes of the file to axes with z up."""
        return _Y_UP if self.up == "y" else np.eye(4)


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


def steadier_axis(found: Scaling, points: Floats) -> Scaling:
    """Replace a guessed vertical axis by the other one if the object probably stands along that one.

    The object does if it can be tilted clearly farther, or if only this axis has the object's base at its origin, as
    in scanned objects. `points` (n, 3) are in metres, with the axes and the origin of the file.
    """
    try:
        hull = trimesh.convex.convex_hull(points)
    except QhullError:  # flat sheets
        return found
    corners, centre, size = np.asarray(hull.vertices), hull.center_mass, hull.extents
    tilts = {axis: tilt(corners, centre, -_UNIT[axis]) for axis in AXES}
    based = {axis: abs((corners @ _UNIT[axis]).min()) <= _BASE * (size @ _UNIT[axis]) for axis in AXES}
    other = "z" if found.up == "y" else "y"
    degrees = np.degrees(tilts[other])
    if tilts[other] < STEADY:
        return found
    if based[other] and not based[found.up]:
        reason = f"guessed: its base is at {other} = 0"
    elif tilts[other] > tilts[found.up] + _CLEARLY and not based[found.up]:
        reason = f"guessed: it stands more steadily, up to a tilt of {degrees:.0f} degrees"
    else:
        return found
    return replace(found, up=other, up_reason=f"{reason}; if not, use --up {found.up}")


def _advice(longest: float, unit: str, reason: str) -> str:
    limits = f"a hand carries {MIN_SIDE:g} to {MAX_SIDE:g} m"
    as_unit = "in any unit" if reason == "no unit fits" else f"in {unit} ({reason})"
    size = f"its longest side is {longest:.4g}, which {as_unit} is too {{}}: {limits}"
    size = size.format("small" if longest * UNITS[unit] < MIN_SIDE else "large")
    fitting = [u for u, metres in UNITS.items() if u != unit and MIN_SIDE <= longest * metres <= MAX_SIDE]
    remedy = f"if it is in {' or '.join(fitting)}, use --units {fitting[0]}; else " if fitting else ""
    return f"{size}; {remedy}use --scale {0.2 / (longest * UNITS[unit]):.2g} for a length of 0.2 m"
