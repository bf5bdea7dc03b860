"""Verify the lengths, hashes, derived files and checksums of a record without simulating the run."""

import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from experiments.errors import RecordError
from experiments.record import records
from experiments.record.columns import TRAJECTORY_COLUMNS, action_hashes
from experiments.record.events import check_event
from experiments.record.files import CHECKSUMS, read_checksums, read_json, sha256_of
from experiments.record.metrics import CIRCUMSTANCES, measure
from experiments.record.reader import Record, read_log
from mjsim.world.state import checkpoint_hash


@dataclass(frozen=True)
class Mismatch:
    """A difference that was found while verifying a record.

    Attributes:
        step: First control step that is affected, or None if the steps agree and only a file differs.
        message: Description of the difference.
        file: Name of the file that differs.
    """

    step: int | None
    message: str
    file: str


def damage(record: Record) -> list[Mismatch]:
    """Check the lengths and hashes in a record. Return the mismatches, sorted by control step."""
    checks = (_lengths, _actions, _log, _checkpoints, _lines, _settings)
    return sorted((m for check in checks for m in check(record)), key=lambda mismatch: mismatch.step or 0)


def derived_mismatches(directory: Path, record: Record) -> Iterator[Mismatch]:
    """Yield the differences between the stored plans and metrics and those computed from the record."""
    plans = record.plans
    yield from _derived(directory, records.PLAN, lambda found: _plan_fault(found, plans))
    yield from _derived(directory, records.METRICS, lambda found: _metrics_fault(found, record))


def checksum_mismatches(directory: Path) -> Iterator[Mismatch]:
    """Yield a mismatch for each file of a run that is missing, added or changed."""
    try:
        sums = read_checksums(directory)
    except RecordError as error:
        yield Mismatch(None, str(error), CHECKSUMS)
        return
    for name in sorted({*sums, *(name for name in records.FILES if (directory / name).is_file())}):
        if name not in sums:
            yield Mismatch(None, f"{name} was not written with the run: {CHECKSUMS} does not name it", name)
        elif not (directory / name).is_file():
            yield Mismatch(None, f"{name} is missing; it was written with the run", name)
        elif sha256_of(directory / name) != sums[name]:
            yield Mismatch(None, f"{name} is not the file that was written: its SHA-256 is another", name)


def check_log(directory: Path) -> None:
    """Check the format of an event log and the fields of all events.

    Raises:
        RecordError: The folder is not a run directory, or an event is invalid.
        ReplayError: The log has the format of another version.
    """
    for number, line in enumerate(read_log(directory).splitlines(), start=1):
        try:
            check_event(line)
        except RecordError as error:
            raise RecordError(f"{directory / records.EVENTS}, line {number}: {error}") from error


def _lengths(record: Record) -> Iterator[Mismatch]:
    steps = record.steps
    lengths = {(records.TRAJECTORY, name): len(record.trajectory[name]) for name in TRAJECTORY_COLUMNS}
    lengths[records.RECORDING, "action_hash"] = len(record.recording["action_hash"])
    for name in ("log_size", "log_hash"):
        lengths[records.RECORDING, name] = len(record.recording[name]) - 1
    for (file, name), length in lengths.items():
        if length != steps:
            step = max(0, min(length, steps))
            yield Mismatch(step, f"{file}: {name} has {length} steps where the states have {steps}", file)


def _actions(record: Record) -> Iterator[Mismatch]:
    hashes = record.recording["action_hash"][: record.steps]
    actions = record.trajectory["action"][: len(hashes)]
    bad = np.flatnonzero(action_hashes(actions) != hashes[: len(actions)])
    if bad.size:
        what = f"{records.TRAJECTORY}: the action is not the one that was recorded"
        yield Mismatch(int(bad[0]), what, records.TRAJECTORY)


def _log(record: Record) -> Iterator[Mismatch]:
    digest, end, log = hashlib.sha1(usedforsecurity=False), 0, record.log
    sizes, hashes = record.recording["log_size"].tolist(), record.recording["log_hash"].tolist()
    for step, (size, expected) in enumerate(zip(sizes, hashes, strict=False)):
        start, end, at = end, size, max(0, step - 1)
        if size < start:
            yield Mismatch(at, f"{records.RECORDING}: log_size goes backwards", records.RECORDING)
            return
        digest.update(log[start:size])
        if size > len(log):
            what = (
                f"{records.EVENTS} is truncated: it has {len(log)} bytes, but more were written by this step"
            )
            yield Mismatch(at, what, records.EVENTS)
            return
        if int.from_bytes(digest.digest()[:8], "little") != expected:
            first = log[:start].count(b"\n") + 1
            last = first + max(0, log[start:size].count(b"\n") - 1)
            lines = f"line {first}" + (f" to {last}" if last > first else "")
            yield Mismatch(at, f"{records.EVENTS} is not as written, at {lines}", records.EVENTS)
            return
    if end != len(log):
        yield Mismatch(max(0, len(sizes) - 2), f"{records.EVENTS} continues after its end", records.EVENTS)


def _lines(record: Record) -> Iterator[Mismatch]:
    lines = zip(record.steps_of_events, record.log.splitlines(), strict=True)
    for number, (step, line) in enumerate(lines, start=1):
        try:
            check_event(line)
        except RecordError as error:
            yield Mismatch(step, f"line {number}: {error}", records.EVENTS)
            return


def _checkpoints(record: Record) -> Iterator[Mismatch]:
    steps = record.checkpoint_steps
    physics, details, hashes = (
        record.recording[f"checkpoint_{part}"] for part in ("physics", "details", "hash")
    )
    least = min(len(physics), len(details), len(hashes), len(steps))
    if {len(physics), len(details), len(hashes), len(steps)} != {least}:
        first = steps[least] if least < len(steps) else 0
        yield Mismatch(max(0, first), f"{records.RECORDING}: checkpoints are missing", records.RECORDING)
        return
    for number, step in enumerate(steps):
        intact = checkpoint_hash(physics[number], str(details[number])) == int(hashes[number])
        if not 0 <= step < record.steps or not intact:
            what = f"{records.RECORDING}: the checkpoint is not the one that was recorded"
            yield Mismatch(max(0, min(step, record.steps)), what, records.RECORDING)


def _settings(record: Record) -> Iterator[Mismatch]:
    start, names = record.start, record.names
    if hashlib.sha256(record.episode.to_json().encode()).hexdigest() != start["episode_sha256"]:
        yield Mismatch(0, f"{records.EPISODE} is not the episode that was run", records.EPISODE)
    what = f"{records.EVENTS}: the start event has"
    if start["objects"] != len(names):
        message = f"{what} {start['objects']!r} objects, the episode has {len(names)}"
        yield Mismatch(0, message, records.EVENTS)
    if sorted(start["order"]) != sorted(names):
        message = f"{what} an order of other objects than the episode's"
        yield Mismatch(0, message, records.EVENTS)


def _derived(directory: Path, name: str, fault: Callable[[Any], str | None]) -> Iterator[Mismatch]:
    if not (directory / name).exists():
        return
    try:
        wrong = fault(read_json(directory / name))
    except RecordError as error:
        wrong = str(error)
    if wrong is not None:
        yield Mismatch(None, f"{name} {wrong}", name)


def _plan_fault(found: Any, plans: Any) -> str | None:
    return None if _same(found, plans) else "does not hold the plans of the log"


def _metrics_fault(found: Any, record: Record) -> str | None:
    if not isinstance(found, dict):
        return "is not an object"
    expected = measure(record.events, record.trajectory)
    missing = [name for name in (*expected, *CIRCUMSTANCES) if name not in found]
    added = [name for name in found if name not in expected and name not in CIRCUMSTANCES]
    if missing or added:
        return f"lacks {', '.join(missing)}" if missing else f"has {', '.join(added)}, which is not a metric"
    for name, value in expected.items():
        if not _same(found[name], value):
            return f"has {name} = {found[name]!r}, log and trajectory give {value!r}"
    return None


def _same(one: Any, other: Any) -> bool:
    """Return True if two values are equal as JSON, where 1, 1.0 and true are different values."""
    return json.dumps(one) == json.dumps(other)
