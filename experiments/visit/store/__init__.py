"""Access to the database of a study. Other packages never access the database directly."""

from experiments.visit.store.copies import restore
from experiments.visit.store.store import Store, change_database
from experiments.visit.store.values import (
    Answer,
    Assignment,
    CellQuota,
    Counts,
    PaymentEvent,
    PersonRow,
    PhaseRow,
    Researcher,
    Role,
    Rule,
    Status,
    StudyState,
    TrialRow,
    utc_now,
)

__all__ = [
    "Answer",
    "Assignment",
    "CellQuota",
    "Counts",
    "PaymentEvent",
    "PersonRow",
    "PhaseRow",
    "Researcher",
    "Role",
    "Rule",
    "Status",
    "Store",
    "StudyState",
    "TrialRow",
    "change_database",
    "restore",
    "utc_now",
]
