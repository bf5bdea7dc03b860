"""Constants for the phases of a visit, the origin of a run, and the reason why a session ended."""

from collections.abc import Iterable

from experiments.errors import ConfigError

STORY, FLYTHROUGH, TRAINING, TASK = PHASES = ("story", "flythrough", "training", "task")
HUMAN = "human"  # participant name that all humans have
REHEARSAL = "rehearsal"  # name of all simulated participants in `mjsim study rehearse`
REHEARSED = "Rehearsed, with answers drawn at random"
SIMULATED, PARTLY_SIMULATED, RECORDED = "Simulated", "Partly simulated", "Recorded from people"


def phases_of(text: str) -> tuple[str, ...]:
    """Parse a comma-separated list of phases that ends with the task, such as `flythrough,task`."""
    names = tuple(part.strip() for part in text.split(","))
    unknown = [name for name in names if name not in PHASES]
    if unknown:
        raise ConfigError(f"no phase {unknown[0]!r}; there are {', '.join(PHASES)}")
    if names != tuple(name for name in PHASES if name in names) or names[-1] != TASK:
        raise ConfigError(
            f"phases are {','.join(names)!r}; name each at most once, in the order {','.join(PHASES)}, "
            "with the task last"
        )
    return names


def is_simulated(user: object) -> bool:
    return user != HUMAN


def origin_of(users: Iterable[object]) -> str:
    """Return a label for the origin of trials, such as `Simulated` or `Recorded from people`."""
    users = set(users)
    if users == {REHEARSAL}:
        return REHEARSED
    kinds = {is_simulated(user) for user in users}
    return PARTLY_SIMULATED if len(kinds) > 1 else RECORDED if kinds == {False} else SIMULATED


ALL_DELIVERED = "all delivered"
TIME_LIMIT = "time limit"
INTERRUPTED = "interrupted"
PHYSICS_ERROR = "physics error"
ERROR = "error"  # any other error, for example in a custom participant

COMPLETE = (ALL_DELIVERED, TIME_LIMIT)
BROKEN_OFF = (INTERRUPTED, ERROR)  # reasons that can leave the last control step incomplete


class LeaveSession(BaseException):  # not an Exception, so error handlers do not catch it
    """Raised by a participant or a viewer to leave a session early. This is not a failure."""
