"""Typed errors of the experiments.

ExperimentError
├── ConfigError     an option of a run or batch is unusable
├── SessionError    a session cannot continue
├── RecordError     a run directory is missing, incomplete or in the way
├── UserCodeError   a user-supplied participant, condition or planner raised, or returned something unusable
├── StatisticsError the data do not allow a statistical test
├── StoreError      the database of a study cannot be used, or what is asked contradicts what it holds
└── ReplayError     a recorded run cannot be replayed, or differs from its record
"""

from collections.abc import Sequence


class ExperimentError(Exception):
    """Base of every error raised by :mod:`experiments`."""


class ConfigError(ExperimentError):
    """An option of a run or batch is unusable."""


class SessionError(ExperimentError):
    """A session cannot continue."""


class RecordError(ExperimentError):
    """A run directory is missing, incomplete or in the way."""


class UserCodeError(ExperimentError):
    """A user-supplied participant, condition or planner raised, or returned something unusable."""


class StatisticsError(ExperimentError):
    """The data do not allow a statistical test; the message says why."""


class StoreError(ExperimentError):
    """The database of a study cannot be used, or what is asked contradicts what it holds; says what to do."""


class ReplayError(ExperimentError):
    """A recorded run cannot be replayed, or differs from its record.

    Attributes:
        step: First bad control step, or None where no step can be named.
        verdicts: A line for every file of the run that was checked.
    """

    def __init__(self, message: str, step: int | None = None, verdicts: Sequence[str] = ()) -> None:
        super().__init__(message)
        self.step = step
        self.verdicts = tuple(verdicts)
