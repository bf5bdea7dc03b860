"""What the store takes and gives: plain frozen values; no row or connection leaves the store."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal

Status = Literal["arrived", "assigned", "finished", "withdrawn", "screened_out", "no_consent", "timed_out"]
StudyState = Literal["open", "paused", "closed"]
PlaceState = Literal["held", "finished", "released"]
PaymentKind = Literal["reward", "bonus", "screen_out", "partial", "rejection"]
PaymentEventName = Literal["decided", "sending", "confirmed", "failed"]
Role = Literal["owner", "assistant", "viewer"]
Rule = Literal["uniform", "balanced"]

ACTIVE: tuple[Status, ...] = ("arrived", "assigned")


def utc_now() -> datetime:
    return datetime.now(UTC)


@dataclass(frozen=True)
class StudyRow:
    """The study that a store is open for.

    Attributes:
        file_hash: Hash of the study file that it was opened with last.
        quotas: Wanted numbers of people that were changed since, by cell.
    """

    id: int
    name: str
    file_hash: str
    state: StudyState
    created: datetime
    quotas: dict[int, int]


@dataclass(frozen=True)
class Person:
    """A participant.

    Attributes:
        token_hash: SHA-256 of the link's token, hexadecimal; also the name of the visit's folder.
        platform: Where the person comes from, such as `link` or `prolific`.
        phase: Name of the phase that is under way.
        seen: Last sign of life.
        delete_wanted: Whether the person withdrew and wants the data deleted.
        host: Of several, the one that keeps what the person plays; None where nothing was played, or there is but one.
        returning: Whether :meth:`Store.arrive` found the person instead of making one.
    """

    id: int
    token_hash: str
    platform: str
    status: Status
    phase: str
    created: datetime
    seen: datetime
    delete_wanted: bool
    host: str | None = None
    returning: bool = False

    @property
    def active(self) -> bool:
        return self.status in ACTIVE


@dataclass(frozen=True)
class Host:
    """One of several machines that serve a study.

    Attributes:
        seen: When it was heard of last.
        draining: Whether it takes no new visits.
    """

    name: str
    seen: datetime
    draining: bool


@dataclass(frozen=True)
class PhaseRow:
    """A phase of a person: when it was shown first, and how it ended (None while it is under way)."""

    person_id: int
    name: str
    shown: datetime
    ended: datetime | None
    duration_s: float | None
    attempts: int | None
    reason: str | None


@dataclass(frozen=True)
class Answer:
    """What a person answered to an item of a phase; `final` once the phase has ended."""

    person_id: int
    phase: str
    item: str
    value: Any
    given: datetime
    final: bool


@dataclass(frozen=True)
class TrialRow:
    """A trial that a person played, and its run directory, relative to the study's folder."""

    person_id: int
    phase: str
    folder: str
    ended: str
    finished: datetime


@dataclass(frozen=True)
class AuditRow:
    """Who did what."""

    id: int
    at: datetime
    who: str
    action: str
    details: dict[str, Any]


@dataclass(frozen=True)
class CellQuota:
    """What a study wants of a cell: a number of people, and the seeds of their houses, gone through again for more."""

    wanted: int
    house_seeds: Sequence[int]

    def house_seed(self, place: int) -> int:
        """Seed of the house of a place, counted from 0."""
        return self.house_seeds[place % len(self.house_seeds)]


@dataclass(frozen=True)
class Assignment:
    """The place of a person in a cell, both counted from 0, and the person's own seeds."""

    person_id: int
    cell: int
    place: int
    state: PlaceState
    house_seed: int
    person_seed: int
    order_seed: int
    created: datetime


@dataclass(frozen=True)
class CellCount:
    """Places of a cell by state; `held` counts abandoned ones as well, until somebody else gets them."""

    held: int = 0
    finished: int = 0
    released: int = 0


@dataclass(frozen=True)
class Counts:
    """How many people there are, by status, by phase (of those who are under way) and by cell."""

    statuses: Mapping[str, int]
    phases: Mapping[str, int]
    cells: Mapping[int, CellCount]


@dataclass(frozen=True)
class PaymentEvent:
    """A line of the ledger.

    Attributes:
        key: Names the payment for ever.
        attempt: Number of the attempt to send it; 0 when it is decided.
        cents: Hundredths of the currency.
        reference: The platform's own name for the payment, once it is confirmed.
    """

    id: int
    person_id: int
    key: str
    attempt: int
    event: PaymentEventName
    kind: PaymentKind
    cents: int
    currency: str
    reference: str
    note: str
    at: datetime

    @property
    def in_doubt(self) -> bool:
        """Whether the platform may have paid without our knowing, if this is the last event of its key."""
        return self.event == "sending"


@dataclass(frozen=True)
class Researcher:
    """Who may see the researcher's page."""

    id: int
    name: str
    role: Role
    created: datetime
    disabled: bool
