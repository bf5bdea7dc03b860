"""Checks what a run logged of the phases before its task."""

from collections.abc import Iterator
from typing import Any

from experiments.errors import RecordError
from experiments.familiarisation.familiarise import watch_flythrough
from experiments.origin import is_simulated
from experiments.replaying.record_checks import Mismatch
from experiments.replaying.replayer import Replayer
from experiments.runs.phases import FLYTHROUGH, TASK, TRAINING, phases_of
from experiments.runs.records import EVENTS, PHASE_ENDED, Event, read_events
from experiments.runs.records import TRAINING as TRAINING_FOLDER


def phase_mismatches(replayer: Replayer) -> Iterator[Mismatch]:
    """Where the phases of a simulated participant are not those of the trial, or what it saw is not what one sees.

    The record of the training is a run directory of its own, which is replayed by itself.
    """
    record = replayer.record
    if not is_simulated(record.start.get("user")):
        return
    ended = {e["phase"]: e for _, e in record.events if e["event"] == PHASE_ENDED}
    expected = tuple(name for name in phases_of(record.start.get("phases", TASK)) if name != TASK)
    if tuple(ended) != expected:
        yield _mismatch(
            f"the phases {', '.join(expected) or 'none'} were to be, {', '.join(ended)} were logged"
        )
        return
    if FLYTHROUGH in ended:
        yield from _compare(ended[FLYTHROUGH], watch_flythrough(replayer.house, record.person))
    if TRAINING in ended:
        try:
            *_, end = read_events(record.directory / TRAINING_FOLDER / EVENTS)
        except (RecordError, ValueError) as error:
            yield _mismatch(f"the training has no record: {error}")
            return
        yield from _compare(ended[TRAINING], {"duration_s": end.get("t"), "reason": end.get("reason")})


def _compare(logged: Event, found: dict[str, Any]) -> Iterator[Mismatch]:
    for name, value in found.items():
        if logged.get(name) != value:
            yield _mismatch(f"{name} of the {logged['phase']} is {logged.get(name)!r}, it must be {value!r}")


def _mismatch(message: str) -> Mismatch:
    return Mismatch(0, f"{EVENTS}: {message}", EVENTS)
