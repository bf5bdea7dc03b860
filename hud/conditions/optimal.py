"""Optimal: breadcrumbs to the goal of the next step, and the plan as numbered steps (PAPER section 5)."""

from hud.lists import assemble
from hud.markers import breadcrumbs, goal_pin, rims
from hud.projection import pointer_to
from hud.state import ChecklistItem, HudState
from hud.task import TaskView


def hud_state(view: TaskView) -> HudState:
    """Steps done and steps planned, the next one highlighted, and the path to its goal."""
    done = len(view.steps_done)
    steps = (*view.steps_done, *view.plan)
    checklist = tuple(_row(view, i, kind, name, done) for i, (kind, name) in enumerate(steps))
    crumbs = breadcrumbs(view.path) if view.path is not None else ()
    markers = (*crumbs, *rims(crumbs))
    pointer = None
    if view.goal is not None:
        markers += goal_pin(view.goal)
        pointer = pointer_to(view.camera, view.goal) if view.camera is not None else None
    return assemble(view, "Your plan", checklist, markers, pointer)


def _row(view: TaskView, index: int, kind: str, name: str, done: int) -> ChecklistItem:
    item = view.object(name)
    target = view.receptacle(item.receptacle)
    action, room = ("Pick up", item.room) if kind == "pick" else (f"Put in {target.label}", target.room)
    return ChecklistItem(
        text=item.label,
        detail=action if index < done else f"{action} ·\n{room}",
        picture=item.picture,
        number=index + 1,
        done=index < done,
        current=index == done,
    )
