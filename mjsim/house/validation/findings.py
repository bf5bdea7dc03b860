"""Findings: faults of a model or an episode, each with a remedy."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from mjsim.values.errors import brief

Severity = Literal["error", "warning"]


@dataclass(frozen=True)
class Finding:
    """A fault of a model or an episode."""

    rule: str  # broken rule, such as `mass`: a heading in docs/models.md
    subject: str  # faulty model or object, such as `object mug`, `house` or `object_03`
    message: str  # description of the fault, with the faulty value
    remedy: str
    # Errors prevent use. Warnings announce effects that may surprise participants.
    severity: Severity = "error"
    file: str = ""  # name of the file to change, unless `subject` already identifies it
    # Position in the frame of the house or object in metres: (x, y) or (x, y, z)
    place: tuple[float, ...] | None = None

    def __str__(self) -> str:
        where = f"{self.subject} ({self.file})" if self.file else self.subject
        return brief(f"{where}: {self.message}; {self.remedy}")


def errors(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    return tuple(f for f in findings if f.severity == "error")


def one_line(findings: Iterable[Finding], name: object) -> str:
    """Format an exception message from the first error and the number of further errors, prefixed with `name`."""
    first, *more = errors(findings)
    rest = f" ({len(more)} more; `mjsim check` lists them)" if more else ""
    return f"{name}: {first}{rest}"
