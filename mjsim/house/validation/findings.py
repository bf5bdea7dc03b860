"""Findings: faults of a model or an episode, each with a remedy."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from mjsim.values.errors import brief

Severity = Literal["error", "warning"]


@dataclass(frozen=True)
class Finding:
    """A fault of a model or an episode."""

    rule: str  # the broken convention (`mass`), a heading of the rules in docs/models.md
    subject: str  # the faulty thing (`object mug`, `house`, `object_03`)
    message: str  # the fault, with its value
    remedy: str
    severity: Severity = "error"  # errors prevent use, warnings are about surprises for people
    file: str = ""  # name of the file to change, if `subject` does not tell
    place: tuple[float, ...] | None = None  # (x, y) or (x, y, z) in the frame of the house or the object, m

    def __str__(self) -> str:
        where = f"{self.subject} ({self.file})" if self.file else self.subject
        return brief(f"{where}: {self.message}; {self.remedy}")


def errors(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    return tuple(f for f in findings if f.severity == "error")


def one_line(findings: Iterable[Finding], name: object) -> str:
    """Format the first error, prefixed with `name`, and the number of further errors as an exception message."""
    first, *more = errors(findings)
    rest = f" ({len(more)} more; `mjsim check` lists them)" if more else ""
    return f"{name}: {first}{rest}"
