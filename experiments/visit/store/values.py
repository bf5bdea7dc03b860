"""Immutable data classes that the store accepts and returns."""

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
    """A study in the database.

    Attributes:
        file_hash: SHA-256 of the study file when the database was last opened.
        quotas: Target numbers of participants, for all cells in which they differ from the study file.
    """

    id: int
    name: str
    file_hash: str
    state: StudyState
    created: datetime
    quotas: dict[int, int]


@dataclass(frozen=True)
class PersonRow:
    """A participant.

    Attributes:
        token_hash: Hexadecimal SHA-256 of the link's token, which is also the name of the visit's folder.
        seen: Time of the last activity.
        delete_wanted: True if the participant withdrew and asked for deletion.
        host: Host that runs the participant's trials. None before the first trial, or if there is only one host.
        returning: True if :meth:`Store.arrive` found the participant in the database.
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
    """One of several hosts that serve the same study."""

    name: str
    seen: datetime
    draining: bool


@dataclass(frozen=True)
class PhaseRow:
    """A phase of a participant's visit. `ended` and all later fields are None until the phase has ended."""

    person_id: int
    name: str
    shown: datetime
    ended: datetime | None
    duration_s: float | None
    reason: str | None


@dataclass(frozen=True)
class Answer:
    """An answer to an item of a form. `final` is True once the phase has ended."""

    person_id: int
    phase: str
    item: str
    value: Any
    given: datetime
    final: bool


@dataclass(frozen=True)
class TrialRow:
    """A completed trial. `folder` is its run directory, relative to the study's folder."""

    person_id: int
    phase: str
    folder: str
    ended: str
    finished: datetime


@dataclass(frozen=True)
class AuditRow:
    """An entry in the audit log."""

    id: int
    at: datetime
    who: str
    action: str
    details: dict[str, Any]


@dataclass(frozen=True)
class CellQuota:
    """The target number of participants in a cell, and the house seeds that are assigned to them in turn."""

    wanted: int
    house_seeds: Sequence[int]

    def house_seed(self, place: int) -> int:
        """Return the house seed for a place in the cell. Places are numbered from 0."""
        return self.house_seeds[place % len(self.house_seeds)]


@dataclass(frozen=True)
class Assignment:
    """A participant's place in a cell of the design, and the trial seeds. Places are numbered from 0."""

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
    """The numbers of places in a cell, by state. Abandoned places are `held` until they are reassigned."""

    held: int = 0
    finished: int = 0
    released: int = 0


@dataclass(frozen=True)
class Counts:
    """The numbers of participants by status and of places by cell."""

    statuses: Mapping[str, int]
    cells: Mapping[int, CellCount]


@dataclass(frozen=True)
class PaymentEvent:
    """An event in the payment ledger.

    Attributes:
        key: Permanent key of the payment.
        attempt: Number of the attempt to send the payment, or 0 before the first attempt.
        cents: Amount in hundredths of the currency.
        reference: The platform's reference if the payment is confirmed.
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
        """True if it is unknown whether the platform has paid. This is only meaningful for the last event."""
        return self.event == "sending"


@dataclass(frozen=True)
class Researcher:
    """A researcher's account."""

    id: int
    name: str
    role: Role
    created: datetime
    disabled: bool
