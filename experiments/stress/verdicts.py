"""Verdict lines of a benchmark: what was measured, what it should be, and whether it is."""

import operator
from collections.abc import Iterator, Sequence
from typing import Any

RELATIONS = {"<": operator.lt, "<=": operator.le, ">=": operator.ge, ">": operator.gt}
Target = tuple[str, str, str, float]  # label, key of the result, relation, bound


def verdicts(result: dict[str, Any], targets: Sequence[Target]) -> Iterator[str]:
    """One line per target."""
    for label, key, relation, bound in targets:
        holds = RELATIONS[relation](result[key], bound)
        yield f"{label}: {result[key]:.4g} ({relation} {bound:g}: {'holds' if holds else 'MISSED'})"
