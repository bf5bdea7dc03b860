"""What is wrong with a model or an episode: findings, one per fault, each with its remedy."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from mjsim.values.errors import brief

Severity = Literal["error", "warning"]


@dataclass(frozen=True)
class Finding:
    """One fault."""

    rule: str  # convention that is broken (`mass`), a heading of the rules in docs/models.md
    subject: str  # what is at fault (`object mug`, `house`, `object_03`)
    message: str  # where, and with which value
    remedy: str  # what to change
    # `error` where it cannot be used, `warning` where it can but people would be surprised
    severity: Severity = "error"
    file: str = ""  # name of the file to change; empty where the subject says it
    # where, m, (x, y) or (x, y, z) in the frame of the house or of the object; None where it has no place
    place: tuple[float, ...] | None = None

    def __str__(self) -> str:
        where = f"{self.subject} ({self.file})" if self.file else self.subject
        return brief(f"{where}: {self.message}; {self.remedy}")


def errors(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Those that make something unusable."""
    return tuple(f for f in findings if f.severity == "error")


def one_line(findings: Iterable[Finding], name: object) -> str:
    """The first error of what is called `name`, and how many more there are, for an exception."""
    first, *more = errors(findings)
    rest = f" ({len(more)} more; `mjsim check` lists them)" if more else ""
    return f"{name}: {first}{rest}"
