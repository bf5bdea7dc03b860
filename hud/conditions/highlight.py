"""Highlight: a flagpole over every misplaced object, and the room of each in the list (PAPER section 5)."""

from hud.lists import assemble, misplaced_flagpoles, random_order_rows
from hud.state import HudState
from hud.task import TaskObject, TaskView


def hud_state(view: TaskView) -> HudState:
    """The list of `none` with rooms, and flagpoles over misplaced objects, dimmed where something hides them."""

    def detail(item: TaskObject) -> str:
        target = f"→ {view.receptacle(item.receptacle).label}"
        return f"{item.room}\n{target}" if item.status == "loose" else target

    return assemble(view, view.texts.to_put_away, random_order_rows(view, detail), misplaced_flagpoles(view))
