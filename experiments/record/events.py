"""Types of the events that are logged during a task.

The file docs/data.md is generated from the types in this module and in `session_events`.
"""

from typing import Annotated, Union

import msgspec

from experiments.errors import RecordError
from experiments.record.session_events import Count, LoggedEvent
from mjsim.values.actions import EventKind, Refusal
from planner.plan import Status, VisitKind

Metres = Annotated[float, msgspec.Meta(ge=0.0)]
Bounds = tuple[Metres, Metres]
VisitPair = tuple[VisitKind, str]


class PlanEvent(LoggedEvent, frozen=True):
    """The assistant made a plan. This is the first plan, a plan after a deviation, or an improved plan.

    Attributes:
        cost_m: Length of the planned tour in metres, from the person's position to all visited locations.
        lower_bound_m: Lower bound in metres on the length of any tour to these locations.
        status: `optimal` if the planner has proved that no tour is shorter, otherwise `feasible`.
        visits: The visits of the tour, as pairs of action and object.
        improved: True if this plan replaces a longer one for the same state of the task.
        reach_bound_m: Lower bound in metres on the walking distance at maximum reach (docs/metrics.md).
            Present only in the first plan.
    """

    cost_m: Metres
    lower_bound_m: Metres
    status: Status
    visits: list[VisitPair]
    improved: bool = False
    reach_bound_m: Metres | None = None


class AttemptEvent(LoggedEvent, frozen=True):
    """The person tried to pick or place an object.

    Attributes:
        action: `pick` or `place`.
        object: The object; null if no object was named and none was in reach.
        applied: True if the motion started.
        refusal: Reason why the motion did not start, or null.
    """

    action: VisitKind
    object: str | None
    applied: bool
    refusal: Refusal | None


class VisitEvent(LoggedEvent, frozen=True):
    """The person picked up or placed an object successfully.

    Attributes:
        kind: `pick` or `place`.
        object: The object.
        suggested: The suggested visit, or null if there was none.
        deviated: True if the visit differs from the suggested one.
        alternatives: Number of other feasible visits.
        tied_alternatives: Number of alternatives that place another object into the suggested visit's bin.
        tied: True if the visit differs from the suggested one only in which object goes into that bin first.
        position: Position of the person in metres.
        geodesic_m: Length in metres of the shortest walk from the person's position at the previous visit.
        location_m: Planner's distance in metres between the locations of the previous visit and this visit.
        regret_m: Extra length of the remaining task in metres compared with the best visit. It is null if
            it is not proven or not known yet, and absent in trials without regrets.
        suggested_regret_m: Regret of the suggested visit in metres.
        regret_bounds_m: Proven lower and upper bounds in metres on a regret that is null, or absent.
        suggested_regret_bounds_m: The same bounds for the suggested visit.
    """

    kind: VisitKind
    object: str
    suggested: VisitPair | None
    deviated: bool
    alternatives: Count
    tied_alternatives: Count
    tied: bool
    position: tuple[float, float]
    geodesic_m: Metres
    location_m: Metres
    regret_m: Metres | None = None
    suggested_regret_m: Metres | None = None
    regret_bounds_m: Bounds | None = None
    suggested_regret_bounds_m: Bounds | None = None


class RegretEvent(LoggedEvent, frozen=True):
    """The regrets of a visit were computed after the visit was logged.

    Attributes:
        visit: Number of the visit, counted from 0.
        regret_m: As in `visit`.
        suggested_regret_m: As in `visit`.
        regret_bounds_m: As in `visit`.
        suggested_regret_bounds_m: As in `visit`.
    """

    visit: Count
    regret_m: Metres | None = None
    suggested_regret_m: Metres | None = None
    regret_bounds_m: Bounds | None = None
    suggested_regret_bounds_m: Bounds | None = None


class ScrollEvent(LoggedEvent, frozen=True):
    """The person scrolled the task list.

    Attributes:
        rows: Number of rows, which is positive when scrolling towards the end of the list.
    """

    rows: int


TYPES = tuple(LoggedEvent.__subclasses__())  # all types above, but not `OutcomeEvent` and its subtypes


class OutcomeEvent(LoggedEvent, frozen=True):
    """An event in the simulated world.

    Attributes:
        object: The object.
        receptacle: The receptacle, or null if none is involved.
    """

    object: str
    receptacle: str | None


OUTCOMES = {
    EventKind.PICKED: "an object was gripped and lifted",
    EventKind.PICK_FAILED: "a pick started but did not succeed",
    EventKind.PLACED: "an object came to rest in its receptacle",
    EventKind.PLACE_FAILED: "a place started, but the object did not end up in the receptacle",
    EventKind.GRIP_LOST: "a carried object slipped out of a hand",
    EventKind.DISLODGED: "a delivered object left its receptacle again",
    EventKind.EJECTED: "an object was faster than anything could throw it (docs/metrics.md)",
    EventKind.TUNNELLED: "an object went through something solid (docs/metrics.md)",
}
_OUTCOME_TYPES = [
    msgspec.defstruct(kind.name, [], bases=(OutcomeEvent,), frozen=True, tag_field="event", tag=kind.value)
    for kind in EventKind
]
_DECODER: msgspec.json.Decoder[LoggedEvent] = msgspec.json.Decoder(Union[(*TYPES, *_OUTCOME_TYPES)])


def check_event(line: bytes) -> None:
    """Raise `RecordError` if a log line is not a valid event."""
    try:
        _DECODER.decode(line)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise RecordError(f"events.jsonl has an invalid event: {error}") from error
