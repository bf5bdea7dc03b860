"""How sessions end, as logs and metrics name it."""

ALL_DELIVERED = "all delivered"
TIME_LIMIT = "time limit"
INTERRUPTED = "interrupted"
PHYSICS_ERROR = "physics error"
ERROR = "error"  # anything else, such as an error in a user-supplied participant

COMPLETE = (ALL_DELIVERED, TIME_LIMIT)  # nothing disturbed the session
BROKEN_OFF = (
    INTERRUPTED,
    ERROR,
)  # between two control steps, or in one: the last one recorded may not be complete


class LeaveSession(BaseException):  # not an Exception, as nothing failed
    """Raised by a participant or a viewer to leave a session early; not a failure."""
