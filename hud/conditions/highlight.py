"""Highlight: a flagpole over every misplaced object, and the room of each in the list (PAPER section 5)."""

import math

from hud.lists import assemble, random_order_rows
from hud.markers import flagpole
from hud.state import HudState
from hud.task import TaskObject, TaskView

CLOSE = 1.6  # m; about where an object leaves the lower edge of the view


def hud_state(view: TaskView) -> HudState:
    """The list of `none` with rooms, and flagpoles over what still lies about."""

    def detail(thing: TaskObject) -> str:
        target = f"→ {view.receptacle(thing.receptacle).label}"
        return f"{thing.room}\n{target}" if thing.status == "loose" else target

    loose = [o for o in view.objects if o.status == "loose"]
    markers = tuple(
        m for o in loose for m in flagpole(o.position, low=math.dist(o.position[:2], view.position) < CLOSE)
    )
    return assemble(view, "To put away", random_order_rows(view, detail), markers)
