"""Bins: a pin over the bin of every object in the hands."""

import dataclasses
import itertools

from hud.markers import BIN, pin
from hud.state import HudState
from hud.task import TaskView


def apply(view: TaskView, state: HudState) -> HudState:
    """Point out the bins that something in the hands belongs to."""
    if any(marker.role == BIN for marker in state.markers):
        return state
    carried = dict.fromkeys(view.object(name).receptacle for name in view.hands if name is not None)
    pins = (pin(view.receptacle(key).position, BIN) for key in carried)
    return dataclasses.replace(state, markers=(*state.markers, *itertools.chain.from_iterable(pins)))
