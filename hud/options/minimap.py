"""Mini-map: the house from above with the person in it, and what the condition shows in the world."""

import dataclasses

from hud.markers import flagpoles
from hud.state import HudState, MiniMap, Vec2
from hud.task import TaskView

FLOORPLAN = "floorplan"  # key of the picture of the house from above


def apply(view: TaskView, state: HudState) -> HudState:
    """Add the map. It shows the markers of the condition and nothing else, so that it tells no more than they do."""
    if view.bounds is None:
        return state
    goals = _places(state, "goal")
    minimap = MiniMap(
        picture=FLOORPLAN,
        bounds=view.bounds,
        position=view.position,
        heading=view.heading,
        path=_places(state, "breadcrumb"),
        objects=tuple(flagpoles(state).values()),
        goal=goals[0] if goals else None,
    )
    return dataclasses.replace(state, minimap=minimap)


def _places(state: HudState, role: str) -> tuple[Vec2, ...]:
    """Floor positions of the markers of a role, each once, in their order, m."""
    return tuple(dict.fromkeys(marker.position[:2] for marker in state.markers if marker.role == role))
