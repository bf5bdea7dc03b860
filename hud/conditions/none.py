"""No assistance: nothing in the world; objects in random order with picture and bin (PAPER section 5)."""

from hud.lists import assemble, random_order_rows
from hud.state import HudState
from hud.task import TaskObject, TaskView


def hud_state(view: TaskView) -> HudState:
    """The list of objects and the list of bins."""

    def detail(item: TaskObject) -> str:
        return f"→ {view.receptacle(item.receptacle).label}"

    return assemble(view, view.texts.to_put_away, random_order_rows(view, detail))
