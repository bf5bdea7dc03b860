from .base import (
    Choice as Choice,
    Guidance as Guidance,
    Participant as Participant,
    ParticipantFactory as ParticipantFactory,
    Percept as Percept,
    Point as Point,
    positions_of as positions_of,
)
from .behaviour import Parameter as Parameter
from .follower import Follower as Follower
from .looking import FullTurn as FullTurn
from .nearest import Nearest as Nearest
from .registry import participant as participant, participant_names as participant_names
from .visit_executor import VisitExecutor as VisitExecutor
