"""The database of a study with people. Nothing outside of this package speaks to the database."""

from experiments.people.store.store import Store
from experiments.people.store.values import (
    Answer,
    AuditRow,
    Person,
    PhaseRow,
    Status,
    StudyRow,
    StudyState,
    TrialRow,
)

__all__ = [
    "Answer",
    "AuditRow",
    "Person",
    "PhaseRow",
    "Status",
    "Store",
    "StudyRow",
    "StudyState",
    "TrialRow",
]
