"""How much of a world is physics: tiers that share one interface (docs/fidelity.md)."""

from mjsim.fidelity.event import Event
from mjsim.fidelity.full import Full
from mjsim.fidelity.windows import Windows
from mjsim.model.scene import Scene
from mjsim.options import WorldOptions

__all__ = ["make_tier"]


def make_tier(scene: Scene, options: WorldOptions) -> Full | Windows | Event:
    """The tier that the options name, not yet reset."""
    tiers: dict[str, type[Full | Windows | Event]] = {"full": Full, "windows": Windows, "event": Event}
    return tiers[options.fidelity](scene, options)
