"""Checks of what a run directory holds beside the record itself: what was worked out from it, and pictures."""

import json
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from experiments.errors import RecordError
from experiments.files import read_json
from experiments.replaying.record_checks import Mismatch
from experiments.replaying.run_record import RunRecord
from experiments.runs import records
from experiments.runs.checksums import CHECKSUMS, read_checksums, sha256_of
from experiments.runs.metrics import measure
from experiments.runs.records import Event

# What metrics.json says beyond the log and the trajectory; the checksum of the file protects it.
CIRCUMSTANCES = ("frames_sha256", "renderer", "wall_s")


def derived_mismatches(record: RunRecord) -> Iterator[Mismatch]:
    """Where plans and metrics on disk do not follow from log and trajectory, which must have been verified."""
    events = [event for _, event in record.events]
    plans = [event for event in events if event["event"] == "plan"]
    yield from _check(record, records.PLAN, lambda found: _plan_fault(found, plans))
    yield from _check(record, records.METRICS, lambda found: _metrics_fault(found, events, record))


def checksum_mismatches(record: RunRecord) -> Iterator[Mismatch]:
    """Files that are not those that were written with the run."""
    last, directory = record.steps - 1, record.directory
    try:
        sums = read_checksums(directory)
    except RecordError as error:
        yield Mismatch(last, str(error), CHECKSUMS)
        return
    for name in sorted({*sums, *(name for name in records.FILES if (directory / name).is_file())}):
        if name not in sums:
            yield Mismatch(last, f"{name} was not written with the run: {CHECKSUMS} does not name it", name)
        elif not (directory / name).is_file():
            yield Mismatch(last, f"{name} is missing; it was written with the run", name)
        elif sha256_of(directory / name) != sums[name]:
            yield Mismatch(last, f"{name} is not the file that was written: its SHA-256 is another", name)


def _check(record: RunRecord, name: str, fault: Callable[[Any], str | None]) -> Iterator[Mismatch]:
    """Compare a JSON file with what it should hold; a missing file is for the checksums to tell."""
    path, last = record.directory / name, record.steps - 1
    if not path.exists():
        return
    try:
        wrong = fault(read_json(path))
    except RecordError as error:
        wrong = str(error)
    if wrong is not None:
        yield Mismatch(last, f"{name} {wrong}", name)


def _plan_fault(found: Any, plans: Sequence[Event]) -> str | None:
    return None if _same(found, plans) else "does not hold the plans of the log"


def _metrics_fault(found: Any, events: Sequence[Event], record: RunRecord) -> str | None:
    if not isinstance(found, dict):
        return "is not an object"
    expected = measure(events, record.arrays)
    missing = [name for name in (*expected, *CIRCUMSTANCES) if name not in found]
    added = [name for name in found if name not in expected and name not in CIRCUMSTANCES]
    if missing or added:
        what = f"lacks {', '.join(missing)}" if missing else f"has {', '.join(added)}, which nobody measures"
        return what
    for name, value in expected.items():
        if not _same(found[name], value):
            return f"has {name} = {found[name]!r}, log and trajectory give {value!r}"
    return None


def _same(one: Any, other: Any) -> bool:
    """Whether two values are the same JSON; 1, 1.0 and true are not."""
    return json.dumps(one) == json.dumps(other)
