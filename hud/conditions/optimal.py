"""Optimal: breadcrumbs to the next step, flagpoles, and the plan as numbered steps (PAPER section 5)."""

from hud.lists import assemble, misplaced_flagpoles
from hud.markers import breadcrumbs
from hud.state import ChecklistItem, HudState
from hud.task import TaskView
from hud.texts import filled


def hud_state(view: TaskView) -> HudState:
    """Steps done and steps planned, the segment of the plan that leads to the next one, and flagpoles."""
    done = len(view.steps_done)
    steps = (*view.steps_done, *view.plan)
    checklist = tuple(_row(view, i, kind, name, done) for i, (kind, name) in enumerate(steps))
    crumbs = () if view.segment is None else breadcrumbs(view.segment, view.eye_height)
    return assemble(view, view.texts.your_plan, checklist, (*crumbs, *misplaced_flagpoles(view)))


def _row(view: TaskView, index: int, kind: str, name: str, done: int) -> ChecklistItem:
    item = view.object(name)
    target = view.receptacle(item.receptacle)
    picked, texts = kind == "pick", view.texts
    action = texts.pick_up if picked else filled(texts.put_in, Receptacle=target.label)
    room = item.room if picked else target.room
    return ChecklistItem(
        text=item.label,
        detail=action if index < done else f"{action} ·\n{room}",
        picture=item.picture,
        number=index + 1,
        done=index < done,
        current=index == done,
    )
