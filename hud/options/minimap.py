"""Mini-map: the house from above with the person in it, and what the condition shows in the world."""

import dataclasses

from hud.state import HudState, Marker, MiniMap
from hud.task import TaskView

FLOORPLAN = "floorplan"  # key of the picture of the house from above


def apply(view: TaskView, state: HudState) -> HudState:
    """Add the map. It tells no more than the markers do, so that it helps in no other way than the condition."""
    if view.bounds is None:
        return state
    goals = _places(state, "goal")
    minimap = MiniMap(
        picture=FLOORPLAN,
        bounds=view.bounds,
        position=view.position,
        heading=view.heading,
        way=_places(state, "breadcrumb"),
        things=_places(state, "flagpole"),
        goal=goals[0] if goals else None,
    )
    return dataclasses.replace(state, minimap=minimap)


def _places(state: HudState, role: str) -> tuple[tuple[float, float], ...]:
    """Where markers of a role stand, each place once, in their order."""
    return tuple(
        dict.fromkeys(_foot(marker) for marker in state.markers if marker.role == role and _upright(marker))
    )


def _foot(marker: Marker) -> tuple[float, float]:
    return marker.position[0], marker.position[1]


def _upright(marker: Marker) -> bool:
    """Not a flag, which stands beside its pole."""
    return marker.shape != "box"
