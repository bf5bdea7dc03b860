"""Highlight: a flagpole over every misplaced object, and the room of each in the list (PAPER section 5)."""

from hud.lists import assemble, random_order_rows
from hud.markers import flagpole
from hud.state import HudState
from hud.task import TaskObject, TaskView


def hud_state(view: TaskView) -> HudState:
    """The list of `none` with rooms, and flagpoles over what still lies about."""

    def detail(thing: TaskObject) -> str:
        target = f"→ {view.receptacle(thing.receptacle).label}"
        return f"{thing.room}\n{target}" if thing.status == "loose" else target

    markers = tuple(m for o in view.objects if o.status == "loose" for m in flagpole(o.position))
    return assemble(view, "Objects to put away", random_order_rows(view, detail), markers)
