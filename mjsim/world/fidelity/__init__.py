"""The two tiers of fidelity: `full` physics, and `event`, which simulates only what falls (docs/simulation.md).

Serves `mjsim.world.world.World`, which hides the tier behind one interface.
"""

from mjsim.house.scene.scene import Scene
from mjsim.values.options import WorldOptions
from mjsim.world.fidelity.event import Event
from mjsim.world.fidelity.full import Full

__all__ = ["make_tier"]


def make_tier(scene: Scene, options: WorldOptions) -> Full | Event:
    """The tier that the options name, not yet reset."""
    return (Full if options.fidelity == "full" else Event)(scene, options)
