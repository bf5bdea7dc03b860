"""Requirements of benchmarks: what is measured, what it should be, and whether it is."""

import operator
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

_RELATIONS = {"<": operator.lt, "<=": operator.le, ">=": operator.ge, ">": operator.gt}


class Requirement(NamedTuple):
    """A figure of a benchmark's result and the bound that it has to keep.

    Attributes:
        label: The figure for people, with its unit.
        key: The figure in the result.
        relation: `<`, `<=`, `>=` or `>`.
        bound: What the figure is compared with.
    """

    label: str
    key: str
    relation: str
    bound: float


def requirement_lines(result: Mapping[str, Any], requirements: Sequence[Requirement]) -> Iterator[str]:
    """One line per requirement, which ends in `pass` or `FAIL`."""
    for label, key, relation, bound in requirements:
        yield f"{label}: {result[key]:.4g} ({relation} {bound:g}: {outcome(result[key], relation, bound)})"


def outcome(value: float, relation: str, bound: float) -> str:
    """`pass` if a value keeps its bound, else `FAIL`."""
    return "pass" if _RELATIONS[relation](value, bound) else "FAIL"
