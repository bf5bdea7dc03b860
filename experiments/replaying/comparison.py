"""Comparing a replay with the record, control step by control step."""

import dataclasses
from collections.abc import Iterator
from typing import Any

from numpy.typing import NDArray

from experiments import records
from experiments.endings import BROKEN_OFF, PHYSICS_ERROR
from experiments.errors import RecordError
from experiments.files import read_json
from experiments.health import summarise_health
from experiments.metrics import compute_metrics
from experiments.records import Event
from experiments.replaying.replayer import Replayer
from experiments.replaying.run_record import PER_STEP, WORLD_EVENTS, Mismatch, RunRecord

# Events that follow from the physics. Plans and visits are the assistant's; the hashes of the log protect them.
COMPARED_EVENTS = frozenset({*WORLD_EVENTS, "attempt", "end"})


def first_mismatch(replayer: Replayer) -> Mismatch | None:
    """The earliest control step at which a finished replay differs from the record, or None."""
    return min(_mismatches(replayer), key=lambda mismatch: mismatch.step, default=None)


def _mismatches(replayer: Replayer) -> Iterator[Mismatch]:
    if replayer.mismatch is not None:
        yield replayer.mismatch
    yield from _compare_states(replayer)
    yield from _compare_trajectory(replayer)
    yield from _compare_checkpoints(replayer)
    yield from _compare_events(replayer)
    if replayer.mismatch is None and replayer.record.reason != PHYSICS_ERROR:
        yield from _check_derived_files(replayer.record)


def _compare_states(replayer: Replayer) -> Iterator[Mismatch]:
    record, first, hashes = replayer.record, replayer.first, replayer.recording.state_hashes()
    step = _first_difference(hashes, record.recorded.state_hash[first:])
    if step is not None:
        yield Mismatch(first + step, "the state differs from the recorded one")
    if first + len(hashes) < record.steps and replayer.mismatch is None:
        yield Mismatch(first + len(hashes), "the replay ends here, the run went on")


def _compare_trajectory(replayer: Replayer) -> Iterator[Mismatch]:
    arrays = replayer.arrays
    for name in PER_STEP:
        step = _first_difference(arrays[name], replayer.record.arrays[name][replayer.first :])
        if step is not None:
            yield Mismatch(
                replayer.first + step, f"{records.TRAJECTORY}: {name} is not what the replay gives"
            )


def _first_difference(replayed: NDArray[Any], recorded: NDArray[Any]) -> int | None:
    """Index of the first row that differs in any bit; None if all rows that both have are equal."""
    rows = enumerate(zip(replayed, recorded, strict=False))
    return next((i for i, (a, b) in rows if a.tobytes() != b.tobytes()), None)


def _compare_checkpoints(replayer: Replayer) -> Iterator[Mismatch]:
    stored = replayer.record.recorded
    hashes = dict(zip(stored.checkpoint_step.tolist(), stored.checkpoint_hash.tolist(), strict=True))
    for step, state in replayer.recording.checkpoints.items():
        if state.hash != hashes[step]:
            yield Mismatch(step, f"{records.RECORDING}: the checkpoint is not what the replay gives")


def _compare_events(replayer: Replayer) -> Iterator[Mismatch]:
    record = replayer.record
    # The last step of a run that was broken off is not simulated again.
    end = record.steps - 1 if record.reason in BROKEN_OFF else record.steps
    logged = [
        (step, event)
        for step, event in record.events
        if replayer.first <= step < end and event["event"] in COMPARED_EVENTS
    ]
    replayed = [event for event in replayer.events if event["event"] in COMPARED_EVENTS]
    for (step, then), now in zip(logged, replayed, strict=False):
        if then != now:
            what = f"{_describe(then)} was logged, the replay gives {_describe(now)}"
            yield Mismatch(step, f"{records.EVENTS}: {what}")
            return
    if replayer.mismatch is None and len(logged) != len(replayed):
        both = min(len(logged), len(replayed))
        step, extra = [*logged[both:], *((record.steps - 1, event) for event in replayed[both:])][0]
        yield Mismatch(step, f"{records.EVENTS}: only one of log and replay has {_describe(extra)}")


def _describe(event: Event) -> str:
    return f"{event['event']} {event.get('object') or ''}".strip() + f" at {event['t']} s"


def _check_derived_files(record: RunRecord) -> Iterator[Mismatch]:
    """Whether metrics and plans on disk follow from log and trajectory."""
    last = record.steps - 1
    events = [event for _, event in record.events]
    try:
        metrics = read_json(record.directory / records.METRICS)
        plans = read_json(record.directory / records.PLAN)
    except RecordError as error:
        yield Mismatch(last, str(error))
        return
    expected = dataclasses.asdict(compute_metrics(events, record.arrays["position"]))
    expected |= summarise_health(events, record.arrays)
    for name, value in {**expected, "ended": record.reason}.items():
        if name in metrics and metrics[name] != value:
            yield Mismatch(last, f"{records.METRICS}: {name} is {metrics[name]!r}, the log gives {value!r}")
    if plans != [event for event in events if event["event"] == "plan"]:
        yield Mismatch(last, f"{records.PLAN} does not hold the plans of the log")
