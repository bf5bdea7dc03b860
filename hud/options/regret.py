"""Regret: in the list, how many metres longer each possible next step makes the rest of the task."""

import dataclasses

from hud.lists import random_order
from hud.state import ChecklistItem, HudState
from hud.task import Alternative, TaskStep, TaskView
from hud.texts import HudTexts, filled

NEGLIGIBLE = 0.01  # m; less is rounding


def apply(view: TaskView, state: HudState) -> HudState:
    """Add the metres to the rows of the task list; the list stays as it is until they are known."""
    extras = {(a.kind, a.object): a for a in view.alternatives()}
    steps = _steps(view, state)
    if not extras or len(steps) != len(state.checklist):
        return state
    rows = zip(state.checklist, steps, strict=True)
    checklist = tuple(_noted(item, extras.get((step.kind, step.object)), view.texts) for item, step in rows)
    return dataclasses.replace(state, checklist=checklist)


def wording(alternative: Alternative, texts: HudTexts) -> str:
    """How an extra length reads in the list."""
    if alternative.extra <= NEGLIGIBLE:
        return "+0 m"
    shown = f"+{max(alternative.extra, 0.1):.1f} m".replace(".", texts.decimal)
    return filled(texts.at_least, metres=shown) if alternative.at_least else shown


def _noted(item: ChecklistItem, alternative: Alternative | None, texts: HudTexts) -> ChecklistItem:
    past = item.done and item.number is not None
    if alternative is None or past or item.current:  # the current step is what the others are compared with
        return item
    parts = item.detail.split("\n")
    shortest = min(range(len(parts)), key=lambda k: len(parts[k]))
    plain = parts[shortest].rstrip(" ·")
    parts[shortest] = f"{plain} · {wording(alternative, texts)}" + parts[shortest][len(plain) :]
    return dataclasses.replace(item, detail="\n".join(parts))


def _steps(view: TaskView, state: HudState) -> list[TaskStep]:
    """The step of each row: one of the plan, or the next one possible with an object."""
    if any(item.number is not None for item in state.checklist):
        return [*view.steps_done, *view.plan]
    return [TaskStep("place" if o.status == "carried" else "pick", o.name) for o in random_order(view)]
