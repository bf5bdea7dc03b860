"""The two levels of fidelity: `full` simulates everything with physics, `event` only falling objects."""

from mjsim.house.scene.scene import Scene
from mjsim.values.options import WorldOptions
from mjsim.world.fidelity.event import Event
from mjsim.world.fidelity.full import Full

__all__ = ["make_tier"]


def make_tier(scene: Scene, options: WorldOptions) -> Full | Event:
    """Create a simulation with the fidelity given in the options. Call `reset` before its first step."""
    return (Full if options.fidelity == "full" else Event)(scene, options)
