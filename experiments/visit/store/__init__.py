"""The database of a study. No other package accesses it."""

from experiments.visit.store.assignments import choose
from experiments.visit.store.copies import restore
from experiments.visit.store.ledger import Ledger
from experiments.visit.store.store import Store, change_database
from experiments.visit.store.values import (
    Answer,
    Assignment,
    AuditRow,
    CellCount,
    CellQuota,
    Counts,
    Host,
    PaymentEvent,
    PaymentKind,
    PersonRow,
    PhaseRow,
    Researcher,
    Role,
    Rule,
    Status,
    StudyRow,
    StudyState,
    TrialRow,
    utc_now,
)

__all__ = [
    "Answer",
    "Assignment",
    "AuditRow",
    "CellCount",
    "CellQuota",
    "Counts",
    "Host",
    "Ledger",
    "PaymentEvent",
    "PaymentKind",
    "PersonRow",
    "PhaseRow",
    "Researcher",
    "Role",
    "Rule",
    "Status",
    "Store",
    "StudyRow",
    "StudyState",
    "TrialRow",
    "change_database",
    "choose",
    "restore",
    "utc_now",
]
