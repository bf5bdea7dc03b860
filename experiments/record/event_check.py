"""The check of a line of the log, and the events of the world: one type for each kind."""

from typing import Union

import msgspec

from experiments.errors import RecordError
from experiments.record.events import TYPES, LoggedEvent
from mjsim.values.actions import EventKind


class OutcomeEvent(LoggedEvent, frozen=True):
    """Something happened in the world.

    Attributes:
        object: The object.
        receptacle: The receptacle concerned, or null.
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
    """Check that a line of a log is an event with the fields of its kind.

    Raises:
        RecordError: It is not; the message says where.
    """
    try:
        _DECODER.decode(line)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise RecordError(f"events.jsonl has a line that is no event: {error}") from error
