"""Comparing a replay with the record, control step by control step."""

import dataclasses
from collections.abc import Iterator
from typing import Any

from numpy.typing import NDArray

from experiments import records
from experiments.errors import RecordError
from experiments.files import read_json
from experiments.health import summarise_health
from experiments.metrics import compute_metrics
from experiments.records import Event
from experiments.replaying.replayer import Replayer
from experiments.replaying.run_record import PER_STEP, WORLD_EVENTS, Fault, RunRecord
from experiments.session import INTERRUPTED, PHYSICS_ERROR

# What the physics alone decides. Plans and visits are the assistant's; the log's hashes vouch for them.
COMPARED_EVENTS = frozenset({*WORLD_EVENTS, "attempt", "end"})


def first_fault(replayer: Replayer) -> Fault | None:
    """The earliest control step at which a finished replay is not as recorded, or None."""
    return min(_faults(replayer), key=lambda fault: fault.step, default=None)


def _faults(replayer: Replayer) -> Iterator[Fault]:
    if replayer.fault is not None:
        yield replayer.fault
    yield from _state_faults(replayer)
    yield from _row_faults(replayer)
    yield from _checkpoint_faults(replayer)
    yield from _event_faults(replayer)
    if replayer.fault is None and replayer.record.reason != PHYSICS_ERROR:
        yield from _derived_faults(replayer.record)


def _state_faults(replayer: Replayer) -> Iterator[Fault]:
    record, first, hashes = replayer.record, replayer.first, replayer.recording.state_hashes()
    if step := _first_difference(hashes, record.recorded.state_hash[first:]):
        yield Fault(first + step - 1, "the state differs from the recorded one")
    if first + len(hashes) < record.steps and replayer.fault is None:
        yield Fault(first + len(hashes), "the replay is over here, the run went on")


def _row_faults(replayer: Replayer) -> Iterator[Fault]:
    arrays = replayer.arrays
    for name in PER_STEP:
        if step := _first_difference(arrays[name], replayer.record.arrays[name][replayer.first :]):
            what = f"{records.TRAJECTORY}: {name} is not what the replay gives"
            yield Fault(replayer.first + step - 1, what)


def _first_difference(ours: NDArray[Any], theirs: NDArray[Any]) -> int:
    """Number of the first row, counted from 1, that differs in any bit; 0 if the rows in common agree."""
    for number, (a, b) in enumerate(zip(ours, theirs, strict=False), start=1):
        if a.tobytes() != b.tobytes():
            return number
    return 0


def _checkpoint_faults(replayer: Replayer) -> Iterator[Fault]:
    stored = replayer.record.recorded
    hashes = dict(zip(stored.checkpoint_step.tolist(), stored.checkpoint_hash.tolist(), strict=True))
    for step, state in replayer.recording.checkpoints.items():
        if state.hash != hashes[step]:
            yield Fault(step, f"{records.RECORDING}: the checkpoint is not what the replay gives")


def _event_faults(replayer: Replayer) -> Iterator[Fault]:
    record = replayer.record
    interrupted = record.reason == INTERRUPTED
    until = record.steps - 1 if interrupted else record.steps
    logged = [
        (s, e) for s, e in record.events if replayer.first <= s < until and e["event"] in COMPARED_EVENTS
    ]
    ours = [e for e in replayer.events if e["event"] in COMPARED_EVENTS]
    for (step, then), now in zip(logged, ours, strict=False):
        if then != now:
            yield Fault(step, f"{records.EVENTS}: {_brief(then)} was logged, the replay gives {_brief(now)}")
            return
    if replayer.fault is None and len(logged) != len(ours):
        extra = logged[len(ours)] if len(logged) > len(ours) else (record.steps - 1, ours[len(logged)])
        yield Fault(extra[0], f"{records.EVENTS}: only one of log and replay has {_brief(extra[1])}")


def _brief(event: Event) -> str:
    return f"{event['event']} {event.get('object') or ''}".strip() + f" at {event['t']} s"


def _derived_faults(record: RunRecord) -> Iterator[Fault]:
    """What was worked out from log and trajectory still follows from them."""
    last = record.steps - 1
    events = [event for _, event in record.events]
    try:
        metrics = read_json(record.directory / records.METRICS)
        plans = read_json(record.directory / records.PLAN)
    except RecordError as error:
        yield Fault(last, str(error))
        return
    expected = dataclasses.asdict(compute_metrics(events, record.arrays["position"]))
    expected |= summarise_health(events, record.arrays)
    for name, value in {**expected, "ended": record.reason}.items():
        if name in metrics and metrics[name] != value:
            yield Fault(last, f"{records.METRICS}: {name} is {metrics[name]!r}, the log gives {value!r}")
    if plans != [event for event in events if event["event"] == "plan"]:
        yield Fault(last, f"{records.PLAN} does not hold the plans of the log")
