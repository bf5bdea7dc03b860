"""Whether people were simulated: every participant is, except `human`, a person at a keyboard."""

from collections.abc import Iterable

HUMAN = "human"  # name of the participant that nothing simulates
REHEARSAL = (
    "rehearsal"  # name of the simulated participant of `mjsim study rehearse`, who answers questions too
)
REHEARSED = "Rehearsed, with answers drawn at random"
SIMULATED, PARTLY_SIMULATED, RECORDED = "Simulated", "Partly simulated", "Recorded from people"


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
