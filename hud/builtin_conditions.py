"""The built-in assistance conditions (PAPER section 5)."""

import functools

from hud import builtin_options as options
from hud.lists import assemble, misplaced_flagpoles, random_order_rows
from hud.markers import breadcrumbs
from hud.state import ChecklistItem, HudState
from hud.task import TaskObject, TaskView
from hud.texts import filled


def none(view: TaskView) -> HudState:
    """Show only a list of all objects in random order, with their pictures and bins."""

    def detail(item: TaskObject) -> str:
        return f"→ {view.receptacle(item.receptacle).label}"

    return assemble(view, view.texts.to_put_away, random_order_rows(view, detail))


def highlight(view: TaskView) -> HudState:
    """Show all objects in random order with their rooms, and a flagpole over each misplaced object."""

    def detail(item: TaskObject) -> str:
        target = f"→ {view.receptacle(item.receptacle).label}"
        return f"{item.room}\n{target}" if item.status == "loose" else target

    return assemble(view, view.texts.to_put_away, random_order_rows(view, detail), misplaced_flagpoles(view))


def optimal(view: TaskView) -> HudState:
    """Show the plan as a list of numbered steps, with flagpoles and with breadcrumbs to the next step."""
    done = len(view.steps_done)
    steps = (*view.steps_done, *view.plan)
    checklist = tuple(_row(view, i, kind, name, done) for i, (kind, name) in enumerate(steps))
    crumbs = () if view.segment is None else breadcrumbs(view.segment, view.eye_height)
    return assemble(view, view.texts.your_plan, checklist, (*crumbs, *misplaced_flagpoles(view)))


def guided(view: TaskView) -> HudState:
    """Show the condition `optimal` with four additional options that are not described in the paper."""
    added = (options.reroute, options.rims, options.pin, options.pointer)
    return functools.reduce(lambda state, apply: apply(view, state), added, optimal(view))


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
