"""Pointer: an arrow at the edge of the view towards the goal of the plan's next step, while it is out of view."""

import dataclasses

from hud.projection import pointer_to
from hud.state import HudState
from hud.task import TaskView


def apply(view: TaskView, state: HudState) -> HudState:
    """Add the arrow."""
    if view.goal is None or view.camera is None:
        return state
    return dataclasses.replace(state, pointer=pointer_to(view.camera, view.goal))
