"""Pin: a pin over the goal of the plan's next step, the object or the bin."""

import dataclasses

from hud.markers import GOAL, pin
from hud.state import HudState
from hud.task import TaskView


def apply(view: TaskView, state: HudState) -> HudState:
    """Add the pin."""
    if view.goal is None or any(marker.role == GOAL for marker in state.markers):
        return state
    return dataclasses.replace(state, markers=(*state.markers, *pin(view.goal)))
