"""Highlight: a flagpole over every misplaced object, and the room of each in the list (PAPER section 5)."""

import math

from hud.lists import assemble, random_order_rows
from hud.markers import flagpole
from hud.state import HudState, Marker
from hud.task import TaskObject, TaskView

NEAR = 1.6  # m; about where an object leaves the lower edge of the view


def hud_state(view: TaskView) -> HudState:
    """The list of `none` with rooms, and flagpoles over misplaced objects, dimmed where something hides them."""

    def detail(item: TaskObject) -> str:
        target = f"→ {view.receptacle(item.receptacle).label}"
        return f"{item.room}\n{target}" if item.status == "loose" else target

    markers: list[Marker] = []
    for item in view.objects:
        if item.status == "loose":
            low = math.dist(item.position[:2], view.position) < NEAR
            markers += flagpole(item.position, object=item.name, low=low, x_ray=True)
    return assemble(view, "To put away", random_order_rows(view, detail), tuple(markers))
