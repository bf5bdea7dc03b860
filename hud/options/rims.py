"""Rims: a thin white disc around each breadcrumb, for people who do not see red on a brown floor."""

import dataclasses

from hud.markers import BREADCRUMB, RIM, rims
from hud.state import HudState
from hud.task import TaskView


def apply(view: TaskView, state: HudState) -> HudState:  # noqa: ARG001 - every option takes it
    """The same markers, with a rim around every breadcrumb."""
    crumbs = tuple(marker for marker in state.markers if marker.role == BREADCRUMB)
    others = tuple(marker for marker in state.markers if marker.role not in (BREADCRUMB, RIM))
    return dataclasses.replace(state, markers=(*crumbs, *rims(crumbs), *others))
