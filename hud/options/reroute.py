"""Reroute: the breadcrumbs start at the person, and lead a new way when the person leaves them.

In the paper they stay where they were shown until the next pick or place.
"""

import dataclasses

from hud.markers import BREADCRUMB, RIM, breadcrumbs
from hud.options import rims
from hud.state import HudState
from hud.task import TaskView

CLEARANCE = 0.5  # m of path in front of the person left empty, so that nothing fills the view


def apply(view: TaskView, state: HudState) -> HudState:
    """The breadcrumbs of the path from the person in place of those of the segment; nothing where there are none."""
    if view.path is None or not any(marker.role == BREADCRUMB for marker in state.markers):
        return state
    others = tuple(marker for marker in state.markers if marker.role not in (BREADCRUMB, RIM))
    found = dataclasses.replace(
        state, markers=(*breadcrumbs(view.path, view.eye_height, CLEARANCE), *others), rerouted=True
    )
    return rims.apply(view, found) if any(marker.role == RIM for marker in state.markers) else found
