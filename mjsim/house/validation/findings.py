"""Findings, which describe problems in a model or an episode and how to solve them."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from mjsim.values.errors import brief

Severity = Literal["error", "warning"]


@dataclass(frozen=True)
class Finding:
    """A problem in a model or an episode, and how to solve it."""

    rule: str  # name of the violated rule in docs/models.md, such as `mass`
    subject: str  # affected model or object, such as `object mug`, `house` or `object_03`
    message: str  # description of the problem, including the wrong value
    remedy: str
    # A model with errors cannot be used. Warnings are about effects that may surprise participants.
    severity: Severity = "error"
    file: str = ""  # name of the file to correct, unless `subject` identifies the file
    # Position of the problem in the house or object, in metres: (x, y) or (x, y, z)
    place: tuple[float, ...] | None = None

    def __str__(self) -> str:
        where = f"{self.subject} ({self.file})" if self.file else self.subject
        return brief(f"{where}: {self.message}; {self.remedy}")


def errors(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    return tuple(f for f in findings if f.severity == "error")


def one_line(findings: Iterable[Finding], name: object) -> str:
    """Format a message with the name of the subject, the first error and the number of further errors."""
    first, *more = errors(findings)
    rest = f" ({len(more)} more; `mjsim check` lists them)" if more else ""
    return f"{name}: {first}{rest}"
