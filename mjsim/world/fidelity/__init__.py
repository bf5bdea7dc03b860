"""Levels of fidelity: `full` physics, and `event`, which simulates only falling objects (docs/simulation.md)."""

from mjsim.house.scene.scene import Scene
from mjsim.values.options import WorldOptions
from mjsim.world.fidelity.event import Event
from mjsim.world.fidelity.full import Full

__all__ = ["make_tier"]


def make_tier(scene: Scene, options: WorldOptions) -> Full | Event:
    """Create the implementation of the fidelity in the options. Call `reset` before its first step."""
    return (Full if options.fidelity == "full" else Event)(scene, options)
