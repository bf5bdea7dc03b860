"""Viewers of a session, and its progress."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from hud.projection import CameraView
from hud.state import HudState
from mjsim.values.observation import Observation
from mjsim.world.world import World


class Viewer(Protocol):
    """Takes what is shown at every control step, e.g. to film it."""

    def camera(self, world: World) -> CameraView | None:
        """The eye camera through which the HUD is seen; None for a view from outside."""
        ...

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None:
        """Show the present state and its HUD."""
        ...


@dataclass(frozen=True)
class Progress:
    """Progress of a session, for progress bars."""

    time: float
    delivered: int
    total: int


OnProgress = Callable[[Progress], None]
