"""Comparing a replay with the record, control step by control step."""

from collections.abc import Iterator
from typing import Any

from numpy.typing import NDArray

from experiments.record.columns import TRAJECTORY_COLUMNS
from experiments.record.phases import BROKEN_OFF, COMPLETE, PHYSICS_ERROR
from experiments.record.reader import Record
from experiments.record.records import EVENTS, RECORDING, TRAJECTORY, Event
from experiments.record.verify import Mismatch
from experiments.session.assistant import WORLD_EVENTS
from experiments.trials.replay.replayer import Replayer

# Events that follow from the physics, and what the assistant makes of them. Searches of the planner are not repeated:
# its plans and regrets are those of the log, and the hashes of the log protect them.
COMPARED_EVENTS = frozenset({*WORLD_EVENTS, "attempt", "visit", "plan", "end"})
REGRETS = frozenset({"regret_m", "suggested_regret_m"})


def simulated_mismatches(replayer: Replayer) -> Iterator[Mismatch]:
    """Where a finished replay differs from the states, poses, checkpoints and events of the record."""
    if replayer.mismatch is not None:
        yield replayer.mismatch
    replayed = replayer.replayed()
    yield from _compare_states(replayer, replayed)
    yield from _compare_trajectory(replayer, replayed)
    yield from _compare_checkpoints(replayer, replayed)
    yield from _compare_events(replayer, replayed)


def _compare_states(replayer: Replayer, replayed: Record) -> Iterator[Mismatch]:
    record, first, hashes = replayer.record, replayer.first, replayed.recording["state_hash"]
    step = _first_difference(hashes, record.recording["state_hash"][first:])
    if step is not None:
        yield Mismatch(first + step, "the state differs from the recorded one", RECORDING)
    if first + len(hashes) < record.steps and replayer.mismatch is None:
        yield Mismatch(first + len(hashes), "the replay ends here, the run continued", RECORDING)


def _compare_trajectory(replayer: Replayer, replayed: Record) -> Iterator[Mismatch]:
    for name in TRAJECTORY_COLUMNS:
        recorded = replayer.record.trajectory[name][replayer.first :]
        step = _first_difference(replayed.trajectory[name], recorded)
        if step is not None:
            what = f"{TRAJECTORY}: {name} is not what the replay gives"
            yield Mismatch(replayer.first + step, what, TRAJECTORY)


def _first_difference(replayed: NDArray[Any], recorded: NDArray[Any]) -> int | None:
    """Index of the first row that differs in any bit; None if all rows that both have are equal."""
    rows = enumerate(zip(replayed, recorded, strict=False))
    return next((i for i, (a, b) in rows if a.tobytes() != b.tobytes()), None)


def _compare_checkpoints(replayer: Replayer, replayed: Record) -> Iterator[Mismatch]:
    record = replayer.record
    hashes = dict(zip(record.checkpoint_steps, record.recording["checkpoint_hash"].tolist(), strict=True))
    for step, found in zip(
        replayed.checkpoint_steps, replayed.recording["checkpoint_hash"].tolist(), strict=True
    ):
        if found != hashes.get(step):
            yield Mismatch(step, f"{RECORDING}: the checkpoint is not what the replay gives", RECORDING)


def _compare_events(replayer: Replayer, replayed: Record) -> Iterator[Mismatch]:
    record = replayer.record
    broke_off = record.reason not in (*COMPLETE, PHYSICS_ERROR)
    end = max(record.steps - broke_off, 1)  # the last step of a run that broke off is not simulated again
    logged = [
        (step, _comparable(event))
        for step, event in zip(record.steps_of_events, record.events, strict=True)
        if replayer.first <= step < end and event["event"] in COMPARED_EVENTS and not _is_broken_end(event)
    ]
    simulated = replayed.events[replayer.logged_before :]
    found = [_comparable(event) for event in simulated if event["event"] in COMPARED_EVENTS]
    for (step, then), now in zip(logged, found, strict=False):
        if then != now:
            yield Mismatch(step, f"{EVENTS}: {_difference(then, now)}", EVENTS)
            return
    if replayer.mismatch is None and len(logged) != len(found):
        both = min(len(logged), len(found))
        step, extra = [*logged[both:], *((record.steps - 1, event) for event in found[both:])][0]
        yield Mismatch(step, f"{EVENTS}: only one of log and replay has {_describe(extra)}", EVENTS)


def _is_broken_end(event: Event) -> bool:
    """Whether this is the end of a run that broke off, to which a replay does not get."""
    return event["event"] == "end" and event["reason"] in BROKEN_OFF


def _comparable(event: Event) -> Event:
    return {name: value for name, value in event.items() if name not in REGRETS}


def _difference(then: Event, now: Event) -> str:
    if _describe(then) != _describe(now):
        return f"{_describe(then)} was logged, the replay gives {_describe(now)}"
    name = next(n for n in {**then, **now} if then.get(n) != now.get(n) or (n in then) != (n in now))
    return f"{_describe(then)}: {name} is {then.get(name)!r}, the replay gives {now.get(name)!r}"


def _describe(event: Event) -> str:
    return f"{event['event']} {event.get('object') or ''}".strip() + f" at {event['t']} s"
