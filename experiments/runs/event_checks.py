"""Checks that the lines of a log are events (`experiments.runs.event_types`)."""

from typing import Any

import msgspec

from experiments.errors import RecordError
from experiments.runs.event_types import TYPES, Outcome, Start
from mjsim.actions import EventKind


def _decoder() -> msgspec.json.Decoder[Any]:
    union: Any = Start
    outcomes = [
        msgspec.defstruct(
            kind.name.title(), [], bases=(Outcome,), frozen=True, tag_field="event", tag=kind.value
        )
        for kind in EventKind
    ]
    for member in (*TYPES[1:], *outcomes):
        union = union | member
    return msgspec.json.Decoder(union)


_DECODER = _decoder()


def check_event(line: bytes) -> None:
    """Check that a line of a log is an event with the fields of its kind.

    Raises:
        RecordError: It is not; the message says where.
    """
    try:
        _DECODER.decode(line)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise RecordError(f"events.jsonl has a line that is no event: {error}") from error
