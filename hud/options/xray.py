"""X-ray: every marker also shows, dimmed, through walls."""

import dataclasses

from hud.state import HudState
from hud.task import TaskView


def apply(view: TaskView, state: HudState) -> HudState:  # noqa: ARG001 - every option takes it
    """The same markers, shown through walls."""
    markers = tuple(dataclasses.replace(marker, x_ray=True) for marker in state.markers)
    return dataclasses.replace(state, markers=markers)
