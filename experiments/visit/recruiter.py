"""The interface of recruitment platforms: arrivals, and the link that leads back to the platform."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol

from experiments.visit.tokens import TOKEN, token_hash

AFTER = "after"  # query parameter with the token of an earlier visit
Leaving = Literal["finished", "screened_out", "no_consent", "withdrawn", "timed_out"]


@dataclass(frozen=True)
class Candidate:
    """A person who may take part.

    Attributes:
        key: The platform's id of the person, by which a second visit is recognized, or None.
        identity: All ids needed for payment. They never leave the store.
    """

    key: str | None = None
    identity: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Preview:
    """A person who looks at the study before accepting it."""


@dataclass(frozen=True)
class InvalidLink:
    """A link that is not valid for the platform, and the reason."""

    reason: str


@dataclass(frozen=True)
class WayBack:
    """How the last page sends the participant back to the platform.

    Attributes:
        fields: Fields of a form that is posted to `url`, or None for a plain link.
        gives_back: True if the participant must return the task on the platform's page.
    """

    code: str = ""
    url: str = ""
    fields: Mapping[str, str] | None = None
    label: Literal["back", "next_person"] = "back"
    gives_back: bool = False


class Recruiter(Protocol):
    """A recruitment platform.

    Attributes:
        platform: Name in the study file.
        parameters: Query parameters of its links, which the welcome page passes on.
        has_time_limit: True if the platform limits the duration of a participation.
        embedded_by: Sites that may embed the study in a frame and receive its last form.
    """

    platform: str
    parameters: tuple[str, ...]
    has_time_limit: bool
    embedded_by: tuple[str, ...]

    def arrive(self, query: Mapping[str, str]) -> Candidate | Preview | InvalidLink:
        """Check the query of the link with which a person arrives."""
        ...

    def way_back(self, how: Leaving, identity: Mapping[str, str]) -> WayBack:
        """Return how a participant with this final status gets back to the platform."""
        ...


class OpenLink:
    """An open link. Everyone may take part, and gets a personal link for returning.

    Args:
        platform: `link`, or `lab`, where the last page leads to the first one for the next participant.
        repeats: True if a link for playing again contains the token of the earlier visit.
    """

    has_time_limit = False
    embedded_by: tuple[str, ...] = ()

    def __init__(self, platform: str = "link", code: str = "", *, repeats: bool = False) -> None:
        self.platform, self._code = platform, code
        self.parameters: tuple[str, ...] = (AFTER,) if repeats else ()

    def arrive(self, query: Mapping[str, str]) -> Candidate:
        earlier = query.get(AFTER, "") if AFTER in self.parameters else ""
        return Candidate(identity={AFTER: token_hash(earlier)} if TOKEN.fullmatch(earlier) else {})

    def way_back(self, how: Leaving, identity: Mapping[str, str]) -> WayBack:  # noqa: ARG002 - there are no ids
        code = self._code if how == "finished" else ""
        return WayBack(code, "/", label="next_person") if self.platform == "lab" else WayBack(code)
