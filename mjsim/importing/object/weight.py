"""Mass, centre of mass and inertia of an object."""

from dataclasses import dataclass

import numpy as np
import trimesh

from mjsim.formats.scene.surface import Floats
from mjsim.house.validation.object_rules import MASS
from mjsim.values.errors import AssetError

MIN_MASS, MAX_MASS = MASS
DENSITY = 400.0  # kg/m^3, between cloth and hollow plastic, and wood
_MIN_GYRATION = 0.005  # m; the radius of gyration of something as wide as the thinnest part


@dataclass(frozen=True, eq=False)
class Weight:
    """How an object is weighed."""

    mass: float  # kg
    centre: Floats  # centre of mass, m, (3,)
    inertia: Floats  # about the centre of mass, kg m^2, (3, 3)
    reason: str  # where the mass comes from

    def moved(self, transform: Floats) -> "Weight":
        """In another frame, by a rigid transform (4, 4)."""
        turn = transform[:3, :3]
        centre = turn @ self.centre + transform[:3, 3]
        return Weight(self.mass, centre, turn @ self.inertia @ turn.T, self.reason)


def weigh(body: trimesh.Trimesh, *, mass: float | None, density: float | None) -> Weight:
    """Weigh a closed body, m, by its mass, kg, or its density, kg/m^3; by `DENSITY` if neither is given.

    `AssetError` where the mass is not one that a hand carries.
    """
    volume = float(body.volume)
    litres = f"{1e3 * volume:.3g} litres"
    total = mass if mass is not None else volume * (density or DENSITY)
    reason = "given" if mass is not None else f"{density or DENSITY:g} kg/m3 in {litres}"
    if mass is None and density is None:
        reason = f"assumed {reason}; set it by --mass or --density"
        if not MIN_MASS <= total <= MAX_MASS:
            reason = f"the {'least' if total < MIN_MASS else 'most'} that is allowed; {reason}"
            total = min(max(total, MIN_MASS), MAX_MASS)
    if not MIN_MASS <= total <= MAX_MASS:
        remedy = f"use --mass with a mass in between (it has {litres})"
        raise AssetError(
            f"it would weigh {total:.3g} kg ({reason}): a hand carries {MIN_MASS} to {MAX_MASS} kg; {remedy}"
        )
    centre = np.asarray(body.center_mass)
    return Weight(total, centre, _inertia(body, total), reason)


def _inertia(body: trimesh.Trimesh, mass: float) -> Floats:
    """Inertia (3, 3) about the centre of mass, kg m^2; nothing is lighter to turn than a thin rod about itself."""
    values, axes = np.linalg.eigh(np.asarray(body.moment_inertia) * mass / body.volume)
    values = np.maximum(values, mass * _MIN_GYRATION**2)
    values[2] = min(
        values[2], values[0] + values[1]
    )  # a body that cuts itself may seem to exceed what is possible
    return np.asarray(axes @ np.diag(values) @ axes.T)
