"""Compare a replay with the record of the run, and report the result for each file."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from experiments.errors import RecordError
from experiments.record import records
from experiments.record.columns import TRAJECTORY_COLUMNS
from experiments.record.files import CHECKSUMS
from experiments.record.phases import (
    BROKEN_OFF,
    COMPLETE,
    FLYTHROUGH,
    PHYSICS_ERROR,
    TASK,
    TRAINING,
    is_simulated,
    phases_of,
)
from experiments.record.reader import Record
from experiments.record.records import EVENTS, PHASE_ENDED, RECORDING, TRAJECTORY, Event, read_events
from experiments.record.verify import Mismatch
from experiments.session.assistant import WORLD_EVENTS
from experiments.session.familiarise import watch_flythrough
from experiments.trials.design import counted
from experiments.trials.replay.replayer import Replayer

# Events that a replay recomputes. Plans and regrets are copied from the log instead of being computed again,
# so they are protected only by the hashes of the log.
COMPARED_EVENTS = frozenset({*WORLD_EVENTS, "attempt", "visit", "plan", "end"})
REGRETS = frozenset({"regret_m", "suggested_regret_m", "regret_bounds_m", "suggested_regret_bounds_m"})
SIMULATED = (records.EVENTS, records.TRAJECTORY, records.RECORDING)  # files verified by the simulation
DERIVED = (records.PLAN, records.METRICS)  # files computed from the files above


def simulated_mismatches(replayer: Replayer) -> Iterator[Mismatch]:
    """Yield the differences between a finished replay and the record of the run."""
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
    end = max(record.steps - broke_off, 1)  # the last step of an interrupted run is not replayed
    logged = [
        (step, _comparable(event))
        for step, event in zip(record.steps_of_events, record.events, strict=True)
        if replayer.first <= step < end and event["event"] in COMPARED_EVENTS and not _is_broken_end(event)
    ]
    copied = record.events_before(replayer.first) if replayer.first else 0  # events that come from the record
    found = [_comparable(event) for event in replayed.events[copied:] if event["event"] in COMPARED_EVENTS]
    for (step, then), now in zip(logged, found, strict=False):
        if then != now:
            yield Mismatch(step, f"{EVENTS}: {_difference(then, now)}", EVENTS)
            return
    if replayer.mismatch is None and len(logged) != len(found):
        both = min(len(logged), len(found))
        step, extra = [*logged[both:], *((record.steps - 1, event) for event in found[both:])][0]
        yield Mismatch(step, f"{EVENTS}: only one of log and replay has {_describe(extra)}", EVENTS)


def _is_broken_end(event: Event) -> bool:
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


def phase_mismatches(replayer: Replayer) -> Iterator[Mismatch]:
    """Yield the differences between a replay and the record in the phases before a simulated task.

    The training has its own run directory, which is replayed separately.
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
            *_, end = read_events(replayer.directory / TRAINING / EVENTS)
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


@dataclass(frozen=True)
class Verdict:
    """The result of a replay for one file, with a description of the check or of the fault."""

    file: str
    verified: bool
    text: str

    def __str__(self) -> str:
        return f"{self.file:<15} {'verified' if self.verified else 'NOT VERIFIED'}: {self.text}"


def verdicts(
    directory: Path, record: Record, mismatches: Sequence[Mismatch], first: int, end: int
) -> tuple[Verdict, ...]:
    """Return a verdict for each file of the run that exists or should exist.

    Args:
        directory: The run directory.
        record: Record of the run.
        mismatches: All mismatches that were found.
        first: First control step that was simulated again.
        end: Control step after the last one that was simulated again.
    """
    wrong: dict[str, str] = {}
    for mismatch in mismatches:
        wrong.setdefault(mismatch.file, mismatch.message)
    present = [name for name in records.FILES if (directory / name).exists() or name in wrong]
    others = [name for name in wrong if name not in present]
    simulated = end > first and not any(name in wrong for name in SIMULATED)

    def verdict(name: str) -> Verdict:
        if name in wrong:
            return Verdict(name, False, wrong[name])
        if name in DERIVED and not simulated:
            return Verdict(name, False, "the files that it follows from are not as recorded")
        if name in SIMULATED and not simulated:
            steps = f"only steps {first} to {end} were" if end > first else "nothing was"
            return Verdict(name, False, f"no fault was found, but {steps} simulated again")
        return Verdict(name, True, _checked(record, name, first))

    return tuple(verdict(name) for name in (*present, *others))


def _checked(record: Record, name: str, first: int) -> str:
    start = f" from step {first} on" if first else ""
    match name:
        case records.EPISODE:
            return "the episode of the log"
        case records.EVENTS:
            events = counted(len(record.events), "event")
            return f"{events}, simulated again{start}; plans and regrets by hash"
        case records.TRAJECTORY:
            return f"{counted(record.steps, 'step')}, simulated again{start}"
        case records.RECORDING:
            checkpoints = counted(len(record.checkpoint_steps), "checkpoint")
            return f"{counted(record.steps, 'state')} and {checkpoints}{start}"
        case records.PLAN:
            return "the plans of the log"
        case records.METRICS:
            return "every number computed again; renderer, wall time and hash of the frames by SHA-256"
    return f"unchanged, by its SHA-256 in {CHECKSUMS}"
