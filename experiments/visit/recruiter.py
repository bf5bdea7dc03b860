"""Where people come from: what a platform says about who arrives, and the way back to it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol

from experiments.visit.tokens import TOKEN, token_hash

AFTER = "after"  # parameter that holds the token of an earlier visit
Leaving = Literal["finished", "screened_out", "no_consent", "withdrawn", "timed_out"]


@dataclass(frozen=True)
class Arrival:
    """Somebody who may take part.

    Attributes:
        key: The platform's id of the person, by which a second visit is recognised; None where there is none.
        identity: All ids that paying needs; they never leave the store.
    """

    key: str | None = None
    identity: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Preview:
    """Somebody who looks at the study before accepting it."""


@dataclass(frozen=True)
class Refusal:
    """A link that does not come from the platform as it should."""

    reason: str


@dataclass(frozen=True)
class WayBack:
    """What a person sees at the end: a code, and where to go.

    Attributes:
        url: Of the platform, or empty.
        fields: Of a form that is posted there; None for a plain link.
        label: Name of the text of the button.
        gives_back: Whether the person has to give the task back on the platform's page.
    """

    code: str = ""
    url: str = ""
    fields: Mapping[str, str] | None = None
    label: Literal["back", "next_person"] = "back"
    gives_back: bool = False


class Recruiter(Protocol):
    """A platform.

    Attributes:
        platform: Its name in the study file.
        parameters: Names of what its links carry, which the first page keeps.
        has_time_limit: Whether the platform ends a participation that takes too long.
        embedded_by: Sites whose pages show the study in a frame, and to which its last form may be sent.
    """

    platform: str
    parameters: tuple[str, ...]
    has_time_limit: bool
    embedded_by: tuple[str, ...]

    def arrive(self, query: Mapping[str, str]) -> Arrival | Preview | Refusal:
        """Who comes with the query of a link."""
        ...

    def way_back(self, how: Leaving, identity: Mapping[str, str]) -> WayBack:
        """The way back of somebody who leaves."""
        ...


class OpenLink:
    """An open link: every visitor may take part, and gets a personal link to come back to.

    Args:
        platform: `link`, or `lab`, where the last page leads to the first one for the next participant.
        code: Completion code; empty for none.
        repeats: True if the link of a further visit names the earlier one.
    """

    has_time_limit = False
    embedded_by: tuple[str, ...] = ()

    def __init__(self, platform: str = "link", code: str = "", *, repeats: bool = False) -> None:
        self.platform, self._code = platform, code
        self.parameters: tuple[str, ...] = (AFTER,) if repeats else ()

    def arrive(self, query: Mapping[str, str]) -> Arrival:
        """Return an arrival without an id of a platform."""
        earlier = query.get(AFTER, "") if AFTER in self.parameters else ""
        return Arrival(identity={AFTER: token_hash(earlier)} if TOKEN.fullmatch(earlier) else {})

    def way_back(self, how: Leaving, identity: Mapping[str, str]) -> WayBack:  # noqa: ARG002 - nobody is known
        """A code where there is one; in a lab, the first page."""
        code = self._code if how == "finished" else ""
        return WayBack(code, "/", label="next_person") if self.platform == "lab" else WayBack(code)
