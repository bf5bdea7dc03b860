"""Guided: `optimal` with what we think helps beyond the paper: see the options that it applies."""

import functools

from hud.conditions import optimal
from hud.options import pin, pointer, reroute, rims
from hud.state import HudState
from hud.task import TaskView

OPTIONS = (reroute, rims, pin, pointer)


def hud_state(view: TaskView) -> HudState:
    """`optimal`, with a path that follows who strays, rims, a pin at the goal, and a pointer to it out of view."""
    return functools.reduce(lambda state, option: option.apply(view, state), OPTIONS, optimal.hud_state(view))
