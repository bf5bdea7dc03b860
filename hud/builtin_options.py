"""The built-in options, which modify the HUD state that a condition returns."""

import itertools
from dataclasses import replace

from hud import markers
from hud.lists import random_order
from hud.markers import BIN, BREADCRUMB, GOAL, RIM
from hud.projection import pointer_to
from hud.state import FLOORPLAN, ChecklistItem, HudState, Marker, MiniMap, Vec2
from hud.task import Alternative, TaskStep, TaskView
from hud.texts import HudTexts, filled

REROUTE_CLEARANCE = 0.5  # minimum distance from the person to the first breadcrumb, in metres
NEGLIGIBLE = 0.01  # regret below which a step counts as optimal, in metres


def bins(view: TaskView, state: HudState) -> HudState:
    """Add a pin over the receptacle of every carried object."""
    if _has(state, BIN):
        return state
    carried = dict.fromkeys(view.object(name).receptacle for name in view.hands if name is not None)
    pins = (markers.pin(view.receptacle(key).position, BIN) for key in carried)
    return replace(state, markers=(*state.markers, *itertools.chain.from_iterable(pins)))


def minimap(view: TaskView, state: HudState) -> HudState:
    """Add a map of the house that shows the person and the markers of the condition."""
    if view.bounds is None:
        return state
    goals = _floor_positions(state, GOAL)
    added = MiniMap(
        picture=FLOORPLAN,
        bounds=view.bounds,
        position=view.position,
        heading=view.heading,
        path=_floor_positions(state, BREADCRUMB),
        objects=tuple(markers.flagpoles(state).values()),
        goal=goals[0] if goals else None,
    )
    return replace(state, minimap=added)


def pin(view: TaskView, state: HudState) -> HudState:
    """Add a pin over the goal of the next step."""
    if view.goal is None or _has(state, GOAL):
        return state
    return replace(state, markers=(*state.markers, *markers.pin(view.goal)))


def pointer(view: TaskView, state: HudState) -> HudState:
    """Add an arrow that points to the goal of the next step if the goal is out of view."""
    if view.goal is None or view.camera is None:
        return state
    return replace(state, pointer=pointer_to(view.camera, view.goal))


def regret(view: TaskView, state: HudState) -> HudState:
    """Add the regret of each possible next step to its row in the task list, once the regrets are known."""
    known = {(a.kind, a.object): a for a in view.alternatives()}
    steps = _steps(view, state)
    if not known or len(steps) != len(state.checklist):
        return state
    rows = zip(state.checklist, steps, strict=True)
    checklist = tuple(
        _with_regret(item, known.get((step.kind, step.object)), view.texts) for item, step in rows
    )
    return replace(state, checklist=checklist)


def reroute(view: TaskView, state: HudState) -> HudState:
    """Show breadcrumbs from the person to the goal. If the person leaves their path, a new path replaces it.

    In the paper, breadcrumbs stay in place until the next pick or place.
    """
    if view.path is None or not _has(state, BREADCRUMB):
        return state
    crumbs = markers.breadcrumbs(view.path, view.eye_height, REROUTE_CLEARANCE)
    found = replace(state, markers=(*crumbs, *_without_breadcrumbs(state)), rerouted=True)
    return rims(view, found) if _has(state, RIM) else found


def rims(view: TaskView, state: HudState) -> HudState:  # noqa: ARG001 - the interface of options
    """Add a white rim around each breadcrumb, for participants who cannot distinguish red from brown."""
    crumbs = tuple(marker for marker in state.markers if marker.role == BREADCRUMB)
    return replace(state, markers=(*crumbs, *markers.rims(crumbs), *_without_breadcrumbs(state)))


def xray(view: TaskView, state: HudState) -> HudState:  # noqa: ARG001 - the interface of options
    """Make all markers visible through walls, where they appear dimmed."""
    return replace(state, markers=tuple(replace(marker, x_ray=True) for marker in state.markers))


def _has(state: HudState, role: str) -> bool:
    return any(marker.role == role for marker in state.markers)


def _without_breadcrumbs(state: HudState) -> tuple[Marker, ...]:
    return tuple(marker for marker in state.markers if marker.role not in (BREADCRUMB, RIM))


def _floor_positions(state: HudState, role: str) -> tuple[Vec2, ...]:
    return tuple(dict.fromkeys(marker.position[:2] for marker in state.markers if marker.role == role))


def _steps(view: TaskView, state: HudState) -> list[TaskStep]:
    if any(item.number is not None for item in state.checklist):
        return [*view.steps_done, *view.plan]
    return [TaskStep("place" if o.status == "carried" else "pick", o.name) for o in random_order(view)]


def _with_regret(item: ChecklistItem, alternative: Alternative | None, texts: HudTexts) -> ChecklistItem:
    past = item.done and item.number is not None
    if alternative is None or past or item.current:  # regrets are relative to the current step
        return item
    parts = item.detail.split("\n")
    shortest = min(range(len(parts)), key=lambda k: len(parts[k]))
    plain = parts[shortest].rstrip(" ·")
    parts[shortest] = f"{plain} · {_wording(alternative, texts)}" + parts[shortest][len(plain) :]
    return replace(item, detail="\n".join(parts))


def _wording(alternative: Alternative, texts: HudTexts) -> str:
    if alternative.extra <= NEGLIGIBLE:
        return "+0 m"
    shown = f"+{max(alternative.extra, 0.1):.1f} m".replace(".", texts.decimal)
    return filled(texts.at_least, metres=shown) if alternative.at_least else shown
