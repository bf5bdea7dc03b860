"""Typed errors of the experiments.

ExperimentError
├── ConfigError     an option of a run or batch is unusable
├── SessionError    a session cannot go on
└── RecordError     a run directory is missing, incomplete or in the way
"""


class ExperimentError(Exception):
    """Base of every error raised by :mod:`experiments`."""


class ConfigError(ExperimentError):
    """An option of a run or batch is unusable."""


class SessionError(ExperimentError):
    """A session cannot go on."""


class RecordError(ExperimentError):
    """A run directory is missing, incomplete or in the way."""
