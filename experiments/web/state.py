"""States of a session with a person, and the table of their transitions.

The worker owns the state. Server and page hold copies of what it sends.
"""

from collections.abc import Mapping
from enum import StrEnum, auto


class SessionPhase(StrEnum):
    """State of a session. Its clock only advances while it is running."""

    LOADING = auto()
    READY = auto()
    RUNNING = auto()
    PAUSED = auto()
    OVER = auto()
    FAILED = auto()


class Trigger(StrEnum):
    """Cause of a transition."""

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
}  # other triggers have no effect
