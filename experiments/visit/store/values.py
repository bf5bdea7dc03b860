"""Frozen values that the store accepts and returns."""

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
    """The study of a store.

    Attributes:
        file_hash: Hash of the study file at the last opening.
        quotas: Numbers of wanted participants that differ from the study file, by cell.
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
        token_hash: SHA-256 of the link's token, hexadecimal. Also the name of the visit's folder.
        seen: Time of the last activity.
        delete_wanted: True if the participant withdrew and asked for deletion.
        host: Host that has the participant's trials. None if there are no trials yet, or only one host.
        returning: True if :meth:`Store.arrive` found the participant.
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
    """One of several hosts of a study."""

    name: str
    seen: datetime
    draining: bool


@dataclass(frozen=True)
class PhaseRow:
    """A participant's phase. `ended` and the fields after it are None until the phase has ended."""

    person_id: int
    name: str
    shown: datetime
    ended: datetime | None
    duration_s: float | None
    attempts: int | None
    reason: str | None


@dataclass(frozen=True)
class Answer:
    """An answer to an item. `final` is True once the phase has ended."""

    person_id: int
    phase: str
    item: str
    value: Any
    given: datetime
    final: bool


@dataclass(frozen=True)
class TrialRow:
    """A played trial, with its run directory relative to the study's folder."""

    person_id: int
    phase: str
    folder: str
    ended: str
    finished: datetime


@dataclass(frozen=True)
class AuditRow:
    """A line of the audit log."""

    id: int
    at: datetime
    who: str
    action: str
    details: dict[str, Any]


@dataclass(frozen=True)
class CellQuota:
    """Number of participants wanted in a cell, and the house seeds of its places, which are reused in order."""

    wanted: int
    house_seeds: Sequence[int]

    def house_seed(self, place: int) -> int:
        """Return the house seed of the place with this index."""
        return self.house_seeds[place % len(self.house_seeds)]


@dataclass(frozen=True)
class Assignment:
    """A participant's place in a cell, and the participant's seeds. `cell` and `place` count from 0."""

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
    """Places of a cell by state. `held` includes abandoned ones that are not yet reassigned."""

    held: int = 0
    finished: int = 0
    released: int = 0


@dataclass(frozen=True)
class Counts:
    """Numbers of participants by status and by phase (only active ones), and of places by cell."""

    statuses: Mapping[str, int]
    phases: Mapping[str, int]
    cells: Mapping[int, CellCount]


@dataclass(frozen=True)
class PaymentEvent:
    """A row of the ledger.

    Attributes:
        key: Permanent name of the payment.
        attempt: Number of the attempt to send it, 0 for the decision.
        cents: Hundredths of the currency.
        reference: The platform's reference of a confirmed payment.
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
        """True if it is unknown whether the platform has paid. Only valid for the last event of a key."""
        return self.event == "sending"


@dataclass(frozen=True)
class Researcher:
    """An account of the researcher's page."""

    id: int
    name: str
    role: Role
    created: datetime
    disabled: bool
