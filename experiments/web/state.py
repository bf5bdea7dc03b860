"""The states of a session with a person, and the one table of how they follow each other.

The worker owns the state; server and page hold copies of what it sends.
"""

from collections.abc import Mapping
from enum import StrEnum, auto


class SessionPhase(StrEnum):
    """Where a session is: only while it is running does its clock advance."""

    LOADING = auto()
    READY = auto()
    RUNNING = auto()
    PAUSED = auto()
    OVER = auto()
    FAILED = auto()


class Trigger(StrEnum):
    """What moves a session from one phase to the next."""

    OPENED = auto()
    RESTORED = auto()
    RUN = auto()
    PAUSE = auto()
    END = auto()
    FAIL = auto()


LOADING, READY, RUNNING, PAUSED, OVER, FAILED = SessionPhase
TRANSITIONS: Mapping[tuple[SessionPhase, Trigger], SessionPhase] = {
    (LOADING, Trigger.OPENED): READY,
    (LOADING, Trigger.RESTORED): PAUSED,
    (READY, Trigger.RUN): RUNNING,
    (PAUSED, Trigger.RUN): RUNNING,
    (RUNNING, Trigger.PAUSE): PAUSED,
    **{(phase, Trigger.END): OVER for phase in (LOADING, READY, RUNNING, PAUSED)},
    **{(phase, Trigger.FAIL): FAILED for phase in (LOADING, READY, RUNNING, PAUSED, OVER)},
}  # anything else changes nothing
