"""Requirements that a benchmark checks: bounds for its measured values."""

import operator
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

_RELATIONS = {"<": operator.lt, "<=": operator.le, ">=": operator.ge, ">": operator.gt}


class Requirement(NamedTuple):
    """A required bound for the value `key` of a benchmark's result. The label includes the unit."""

    label: str
    key: str
    relation: str
    bound: float


def requirement_lines(result: Mapping[str, Any], requirements: Sequence[Requirement]) -> Iterator[str]:
    """Yield a line of text for each requirement. It ends in `pass` or `FAIL`."""
    for label, key, relation, bound in requirements:
        yield f"{label}: {result[key]:.4g} ({relation} {bound:g}: {outcome(result[key], relation, bound)})"


def outcome(value: float, relation: str, bound: float) -> str:
    return "pass" if _RELATIONS[relation](value, bound) else "FAIL"
