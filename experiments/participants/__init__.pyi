from .base import (
    Choice,
    FullTurn,
    Guidance,
    Participant,
    ParticipantFactory,
    Percept,
    Point,
    positions_of,
)
from .distribution import Parameter
from .follower import Follower
from .nearest import Nearest
from .registry import participant, participant_names
from .visit_executor import VisitExecutor

__all__ = [
    "Choice",
    "Follower",
    "FullTurn",
    "Guidance",
    "Nearest",
    "Parameter",
    "Participant",
    "ParticipantFactory",
    "Percept",
    "Point",
    "VisitExecutor",
    "participant",
    "participant_names",
    "positions_of",
]
