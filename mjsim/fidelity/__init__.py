"""How much of a world is physics: tiers that share one interface (docs/fidelity.md)."""

from collections.abc import Callable

from mjsim.fidelity.event import Event
from mjsim.fidelity.full import Full
from mjsim.fidelity.tier import Tier
from mjsim.fidelity.windows import Windows
from mjsim.model.scene import Scene
from mjsim.options import WorldOptions

__all__ = ["Tier", "make_tier"]

_TIERS: dict[str, Callable[[Scene, WorldOptions], Tier]] = {"full": Full, "windows": Windows, "event": Event}


def make_tier(scene: Scene, options: WorldOptions) -> Tier:
    """The tier that the options name, not yet reset."""
    return _TIERS[options.fidelity](scene, options)
