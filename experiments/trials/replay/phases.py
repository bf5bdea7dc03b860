"""Checks the events of the phases before the task."""

from collections.abc import Iterator
from typing import Any

from experiments.errors import RecordError
from experiments.record.phases import FLYTHROUGH, TASK, TRAINING, is_simulated, phases_of
from experiments.record.records import EVENTS, PHASE_ENDED, Event, read_events
from experiments.record.records import TRAINING as TRAINING_FOLDER
from experiments.record.verify import Mismatch
from experiments.session.familiarise import watch_flythrough
from experiments.trials.replay.replayer import Replayer


def phase_mismatches(replayer: Replayer) -> Iterator[Mismatch]:
    """Where the phases of a simulated participant, or the bins that it saw, are not those of the trial.

    The record of the training is a run directory of its own, which is replayed by itself.
    """
    record = replayer.record
    if not is_simulated(record.start.get("user")):
        return
    ended = {e["phase"]: e for e in record.events if e["event"] == PHASE_ENDED}
    expected = tuple(name for name in phases_of(record.start.get("phases", TASK)) if name != TASK)
    if tuple(ended) != expected:
        logged = ", ".join(ended) or "none"
        yield _mismatch(f"the trial has the phases {', '.join(expected) or 'none'}, logged were {logged}")
        return
    if FLYTHROUGH in ended:
        yield from _compare(ended[FLYTHROUGH], watch_flythrough(replayer.house, record.person))
    if TRAINING in ended:
        try:
            *_, end = read_events(replayer.directory / TRAINING_FOLDER / EVENTS)
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
