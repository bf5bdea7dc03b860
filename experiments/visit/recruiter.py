"""The interface to recruitment platforms, from which participants arrive and to which they return."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol

from experiments.visit.tokens import TOKEN, token_hash

AFTER = "after"  # name of the query parameter that contains the token of an earlier visit
Leaving = Literal["finished", "screened_out", "no_consent", "withdrawn", "timed_out"]


@dataclass(frozen=True)
class Candidate:
    """A person who may take part in the study.

    Attributes:
        key: The person's id on the platform, which identifies returning participants, or None.
        identity: All ids needed for payment. They are never exported.
    """

    key: str | None = None
    identity: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Preview:
    """A person who previews the study on the platform before accepting it."""


@dataclass(frozen=True)
class InvalidLink:
    """An invalid link to the study, and the reason why the platform cannot have made it."""

    reason: str


@dataclass(frozen=True)
class WayBack:
    """The link or form on the last page that takes the participant back to the platform.

    Attributes:
        fields: Fields of a form that is posted to `url`, or None for a plain link.
        gives_back: True if the participant must return the task on the platform's own page.
    """

    code: str = ""
    url: str = ""
    fields: Mapping[str, str] | None = None
    label: Literal["back", "next_person"] = "back"
    gives_back: bool = False


class Recruiter(Protocol):
    """The interface of a recruitment platform.

    Attributes:
        platform: Name of the platform in the study file.
        parameters: Query parameters of the platform's links. The welcome page passes them on.
        submission: Parameters with the ids of the person and of the submission, or empty if there are no such ids.
        has_time_limit: True if the platform limits the duration of visits.
        embedded_by: Origins of pages that may embed the study in a frame and receive its last form.
    """

    platform: str
    parameters: tuple[str, ...]
    submission: tuple[str, ...]
    has_time_limit: bool
    embedded_by: tuple[str, ...]

    def arrive(self, query: Mapping[str, str]) -> Candidate | Preview | InvalidLink:
        """Identify a person from the query parameters of the link that the person has opened."""
        ...

    def way_back(self, how: Leaving, identity: Mapping[str, str]) -> WayBack:
        """Return the link or form that takes a participant with the status `how` back to the platform."""
        ...


class OpenLink:
    """A public link that anyone can use to take part. Each participant gets a personal link for returning.

    Args:
        platform: `link`, or `lab` if the last page should link to the first page for the next participant.
        repeats: True if links for playing again contain the token of the earlier visit.
    """

    submission: tuple[str, ...] = ()
    has_time_limit = False
    embedded_by: tuple[str, ...] = ()

    def __init__(self, platform: str = "link", code: str = "", *, repeats: bool = False) -> None:
        self.platform, self._code = platform, code
        self.parameters: tuple[str, ...] = (AFTER,) if repeats else ()

    def arrive(self, query: Mapping[str, str]) -> Candidate:
        earlier = query.get(AFTER, "") if AFTER in self.parameters else ""
        return Candidate(identity={AFTER: token_hash(earlier)} if TOKEN.fullmatch(earlier) else {})

    def way_back(self, how: Leaving, identity: Mapping[str, str]) -> WayBack:  # noqa: ARG002
        code = self._code if how == "finished" else ""
        return WayBack(code, "/", label="next_person") if self.platform == "lab" else WayBack(code)
