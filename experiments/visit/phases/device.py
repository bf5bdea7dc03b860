"""Check that the participant's computer meets the requirements, such as WebGL 2 and a fast connection."""

import math
from collections.abc import Mapping
from typing import Any

from experiments.visit.phases.base import Again, Answers, Done, FormData, FormPhase, Visitor
from experiments.visit.plan import Device

MEASURES = ("frames_per_s", "latency_ms", "width", "height", "pixel_ratio")
MAX_RENDERER = 200  # maximum length of the WebGL renderer's name, in characters


class DeviceCheck(FormPhase):
    """A page that tests the participant's computer and submits the results."""

    def values(self, visitor: Visitor) -> Mapping[str, Any]:
        needed = self._plan.device
        return {"keyboard": needed.keyboard, "failed": visitor.attempts > 0, "scene": self._plan.scene}

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:  # noqa: ARG002
        measured = _measured(sent)
        if measured is None:
            return Again(self._plan.texts["common"]["needs_script"])
        faults = _faults(measured, self._plan.device)
        if sent.get("give_up"):
            return Done({**measured, "faults": faults}, "screened_out" if faults else "next")
        if faults:
            return Again(" ".join(self.texts[name] for name in faults))
        return Done(measured)

    def example(self) -> dict[str, str]:
        needed = self._plan.device
        fits = {"frames_per_s": max(needed.frames_per_s, 1.0), "latency_ms": needed.latency_ms}
        fits |= {"width": needed.width, "height": needed.height, "pixel_ratio": 1.0}
        return {**{name: str(value) for name, value in fits.items()}, "keyboard": "yes", "webgl": "yes"}


def _faults(measured: Answers, needed: Device) -> list[str]:
    """Return the names of the error texts for all unmet requirements.

    The frame rate is only checked if the browser draws the scene itself.
    """
    found = [
        ("bad_frames", measured["webgl"] and measured["frames_per_s"] < needed.frames_per_s),
        ("bad_latency", measured["latency_ms"] > needed.latency_ms),
        ("bad_keyboard", needed.keyboard and not measured["keyboard"]),
        ("bad_screen", measured["width"] < needed.width or measured["height"] < needed.height),
    ]
    return [name for name, bad in found if bad]


def _measured(sent: FormData) -> Answers | None:
    try:
        values = {name: float(sent.get(name, "")) for name in MEASURES}
    except ValueError:
        return None
    if not all(math.isfinite(value) and 0.0 <= value < 1e6 for value in values.values()):
        return None
    checked = {name: sent.get(name) == "yes" for name in ("keyboard", "webgl")}
    return {**values, **checked, "renderer": sent.get("renderer", "")[:MAX_RENDERER]}
