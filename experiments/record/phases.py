"""Phases of a session, where a recorded run comes from, and why it ended."""

from collections.abc import Iterable

from experiments.errors import ConfigError

STORY, FLYTHROUGH, TRAINING, TASK = PHASES = ("story", "flythrough", "training", "task")
HUMAN = "human"  # name of the participant that nothing simulates
REHEARSAL = "rehearsal"  # name of the simulated participants of `mjsim study rehearse`
REHEARSED = "Rehearsed, with answers drawn at random"
SIMULATED, PARTLY_SIMULATED, RECORDED = "Simulated", "Partly simulated", "Recorded from people"


def phases_of(text: str) -> tuple[str, ...]:
    """The phases that a text such as `flythrough,task` names.

    Raises:
        ConfigError: There is no such phase, they are not in their order, or the task is missing.
    """
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
    """Whether a participant of this name is simulated."""
    return user != HUMAN


def origin_of(users: Iterable[object]) -> str:
    """What trials by participants of these names are: `Simulated`, `Recorded from people`, and so on."""
    users = set(users)
    if users == {REHEARSAL}:
        return REHEARSED
    kinds = {is_simulated(user) for user in users}
    return PARTLY_SIMULATED if len(kinds) > 1 else RECORDED if kinds == {False} else SIMULATED


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
