"""What can be checked of a record without physics: lengths, and the hashes of actions, log and checkpoints."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.runs import records
from experiments.runs.recording import Recorded, action_hashes
from experiments.runs.records import LogDigest

# Arrays of the trajectory that have a row per control step: type, and shape of a row; None for one per object.
ROWS: dict[str, tuple[str, tuple[int | None, ...]]] = {
    "time": ("f8", ()),
    "position": ("f8", (2,)),
    "heading": ("f8", ()),
    "pitch": ("f8", ()),
    "hands": ("i2", (2,)),
    "object_position": ("f8", (None, 3)),
    "object_quaternion": ("f8", (None, 4)),
    "object_status": ("i1", (None,)),
    "action": ("f8", (6,)),
    "penetration_m": ("f8", ()),
    "trunk_penetration_m": ("f8", ()),
    "weld_error_m": ("f8", (2,)),
    "weld_error_rad": ("f8", (2,)),
    "settle_s": ("f8", ()),
}
PER_STEP = tuple(ROWS)


@dataclass(frozen=True)
class Mismatch:
    """Something that differs from the record.

    Attributes:
        step: The first control step that it concerns.
        message: What differs.
        file: Name of the file that is not as recorded.
    """

    step: int
    message: str
    file: str


def check_arrays(arrays: Mapping[str, NDArray[Any]], recorded: Recorded) -> Iterator[Mismatch]:
    """Arrays of another length than the states, and the first action that is not what was recorded."""
    steps = len(recorded.state_hash)
    lengths = {(records.TRAJECTORY, name): len(arrays[name]) for name in PER_STEP}
    lengths[records.RECORDING, "action_hash"] = len(recorded.action_hash)
    lengths[records.RECORDING, "log_size"] = len(recorded.log_size) - 1
    lengths[records.RECORDING, "log_hash"] = len(recorded.log_hash) - 1
    for (file, name), length in lengths.items():
        if length != steps:
            step = max(0, min(length, steps))
            yield Mismatch(step, f"{file}: {name} has {length} steps where the states have {steps}", file)
    actions = arrays["action"][:steps]
    count = min(len(actions), len(recorded.action_hash))
    bad = np.flatnonzero(action_hashes(actions[:count]) != recorded.action_hash[:count])
    if bad.size:
        what = f"{records.TRAJECTORY}: the action is not the one that was recorded"
        yield Mismatch(int(bad[0]), what, records.TRAJECTORY)


def check_log_hashes(log: bytes, recorded: Recorded) -> Iterator[Mismatch]:
    """The first step whose part of the log is not what was written."""
    digest, end = LogDigest(), 0
    for step, (size, expected) in enumerate(zip(recorded.log_size.tolist(), recorded.log_hash, strict=False)):
        begin, end, at = end, size, max(0, step - 1)
        if size < begin:
            yield Mismatch(at, f"{records.RECORDING}: log_size goes backwards", records.RECORDING)
            return
        digest.update(log[begin:size])
        if size > len(log):
            what = f"{records.EVENTS} is cut short: {len(log)} bytes, and more were written here"
            yield Mismatch(at, what, records.EVENTS)
            return
        if digest.hash != int(expected):
            first = log[:begin].count(b"\n") + 1
            last = first + max(0, log[begin:size].count(b"\n") - 1)
            lines = f"line {first}" + (f" to {last}" if last > first else "")
            yield Mismatch(at, f"{records.EVENTS} is not as written, at {lines}", records.EVENTS)
            return
    if end != len(log):
        last = max(0, len(recorded.log_size) - 2)
        yield Mismatch(last, f"{records.EVENTS} goes on after its end", records.EVENTS)


def check_checkpoints(recorded: Recorded) -> Iterator[Mismatch]:
    """Checkpoints that are missing, or not what was recorded."""
    steps, numbers = len(recorded.state_hash), recorded.checkpoint_step.tolist()
    count = {len(getattr(recorded, f"checkpoint_{name}")) for name in ("step", "physics", "details", "hash")}
    if len(count) > 1:
        first = numbers[min(count)] if min(count) < len(numbers) else 0
        yield Mismatch(max(0, first), f"{records.RECORDING}: checkpoints are missing", records.RECORDING)
        return
    for number, step in enumerate(numbers):
        if not 0 <= step < steps or not recorded.checkpoint_is_intact(number):
            what = f"{records.RECORDING}: the checkpoint is not the one that was recorded"
            yield Mismatch(max(0, min(step, steps)), what, records.RECORDING)
