"""Mass, centre of mass and inertia of an object."""

from dataclasses import dataclass

import numpy as np
import trimesh

from mjsim.errors import AssetError
from mjsim.importing.surface import Floats
from mjsim.model.validation.object_rules import MASS

LIGHTEST, HEAVIEST = MASS
DENSITY = 400.0  # kg/m^3, between cloth and hollow plastic, and wood
_LEAST_GYRATION = 0.005  # m; the radius of gyration of something as wide as the thinnest part


@dataclass(frozen=True, eq=False)
class Weight:
    """How an object is weighed.

    Attributes:
        mass: kg.
        centre: Centre of mass, m, shape (3,).
        inertia: About the centre of mass, kg m^2, shape (3, 3).
        reason: Where the mass comes from.
    """

    mass: float
    centre: Floats
    inertia: Floats
    reason: str

    def moved(self, transform: Floats) -> "Weight":
        """In another frame, by a rigid transform (4, 4)."""
        turn = transform[:3, :3]
        centre = turn @ self.centre + transform[:3, 3]
        return Weight(self.mass, centre, turn @ self.inertia @ turn.T, self.reason)


def weigh(body: trimesh.Trimesh, *, mass: float | None, density: float | None) -> Weight:
    """Weigh a closed body, m, by its mass, kg, or its density, kg/m^3; by `DENSITY` if neither is given.

    Raises:
        AssetError: The mass is not one that a hand carries.
    """
    volume = float(body.volume)
    litres = f"{1e3 * volume:.3g} litres"
    total = mass if mass is not None else volume * (density or DENSITY)
    reason = "as said" if mass is not None else f"{density or DENSITY:g} kg/m3 in {litres}"
    if mass is None and density is None:
        reason = f"assumed {reason}; --mass or --density says it"
        if not LIGHTEST <= total <= HEAVIEST:
            reason = f"the {'least' if total < LIGHTEST else 'most'} that is allowed; {reason}"
            total = min(max(total, LIGHTEST), HEAVIEST)
    if not LIGHTEST <= total <= HEAVIEST:
        remedy = f"say --mass with a mass in between (it has {litres})"
        raise AssetError(
            f"it would weigh {total:.3g} kg ({reason}): a hand carries {LIGHTEST} to {HEAVIEST} kg; {remedy}"
        )
    centre = np.asarray(body.center_mass)
    return Weight(total, centre, _inertia(body, total), reason)


def _inertia(body: trimesh.Trimesh, mass: float) -> Floats:
    """Inertia (3, 3) about the centre of mass, kg m^2; nothing is lighter to turn than a thin rod about itself."""
    values, axes = np.linalg.eigh(np.asarray(body.moment_inertia) * mass / body.volume)
    values = np.maximum(values, mass * _LEAST_GYRATION**2)
    return np.asarray(axes @ np.diag(values) @ axes.T)
