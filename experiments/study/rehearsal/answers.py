"""Answers of simulated people: drawn at random, and texts that say so."""

from typing import Any

import numpy as np

from experiments.visit.phases.base import FormPhase, Phase
from experiments.visit.texts.items import Item

MARK = "Rehearsal: drawn at random"


def form_of(phase: Phase, rng: np.random.Generator) -> dict[str, Any]:
    """A form that the phase accepts; a phase of the study's own without items gets an empty one."""
    example: dict[str, Any] = getattr(phase, "example", dict)()
    items = phase.items if isinstance(phase, FormPhase) else ()
    points = len(phase.texts.scale) if isinstance(phase, FormPhase) else 0
    drawn = {item.name: _drawn(item, points, rng) for item in items if item.required or rng.random() < 0.5}
    return {"phase": phase.name, **example, **drawn}


def wrong_form(phase: FormPhase, form: dict[str, Any]) -> dict[str, Any] | None:
    """The form with another answer to a question that has a right one; None where there is none."""
    for item in phase.items:
        if item.right is not None and (others := [c for c in item.choices if c != item.right]):
            return {**form, item.name: others[0]}
    return None


def _drawn(item: Item, points: int, rng: np.random.Generator) -> Any:
    if item.right is not None:
        return str(item.right)
    match item.kind:
        case "scale":
            return str(rng.integers(1, points + 1))
        case "choice":
            return str(rng.choice(item.choices))
        case "several":
            return [choice for choice in item.choices if rng.random() < 0.5] or [item.choices[0]]
        case "number":
            return str(rng.integers(item.low, min(item.high, item.low + 60) + 1))
    return f"{MARK} ({rng.integers(10**6)})"
