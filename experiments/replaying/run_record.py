"""A run directory read back for a replay, with everything in it checked that needs no physics."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments import records
from experiments.errors import RecordError, ReplayError
from experiments.files import read_arrays
from experiments.recording import Recorded, action_hashes
from experiments.records import STATUS_CODE, Event, LogDigest, decode_action
from mjsim.actions import Action, EventKind
from mjsim.episode import Episode
from mjsim.errors import EpisodeError
from mjsim.model.avatar import EYE_HEIGHT
from mjsim.observation import Observation

STATUS = {code: status for status, code in STATUS_CODE.items()}
WORLD_EVENTS = {kind.value: kind for kind in EventKind}
# Dimensions of the arrays that have a row per control step.
PER_STEP = {
    "time": 1,
    "position": 2,
    "heading": 1,
    "pitch": 1,
    "hands": 2,
    "object_position": 3,
    "object_quaternion": 3,
    "object_status": 2,
    "action": 2,
    "penetration_m": 1,
    "trunk_penetration_m": 1,
    "weld_error_m": 2,
    "weld_error_rad": 2,
    "settle_s": 1,
}


@dataclass(frozen=True)
class Fault:
    """Something that is not as recorded, and the first control step concerned."""

    step: int
    what: str


@dataclass(frozen=True, eq=False)
class RunRecord:
    """What a run left behind.

    Attributes:
        directory: Where it was read from.
        start: The log's first event: configuration, versions, fingerprints.
        events: The log up to the first line that cannot be read, each with the control step that wrote it.
        episode: The disorganized house.
        arrays: The trajectory.
        recorded: Hashes and checkpoints.
        fault: The first thing that is wrong without any physics, or None.
    """

    directory: Path
    start: Event
    events: tuple[tuple[int, Event], ...]
    episode: Episode
    arrays: Mapping[str, NDArray[Any]]
    recorded: Recorded
    fault: Fault | None

    @property
    def steps(self) -> int:
        """Control steps recorded, the final state included."""
        return len(self.recorded.state_hash)

    @property
    def reason(self) -> str | None:
        """Why the run ended, or None where its log is cut short."""
        last = self.events[-1][1]
        return str(last.get("reason")) if last["event"] == "end" else None

    def action(self, step: int) -> Action:
        """What was done at a control step; raises `RecordError` where that is no action."""
        names = [o.name for o in self.episode.objects]
        return decode_action(self.arrays["action"][step], [*names, *map(str, self.arrays["unknown_objects"])])

    def moves(self, first: int, end: int) -> NDArray[np.float64]:
        """The moves from control step `first` up to `end` or to the first other action: shape (n, 4)."""
        rows = self.arrays["action"][first:end]
        others = np.flatnonzero((rows[:, 0] != 0.0) | ~np.isfinite(rows).all(axis=1))
        return rows[: others[0] if others.size else len(rows), 2:]

    def next_event(self, first: int) -> int | None:
        """The control step from `first` on at which something happened next in the world; None if nothing did."""
        return next((s for s, e in self.events if s >= first and e["event"] in WORLD_EVENTS), None)

    def observation(self, step: int) -> Observation:
        """What the assistant saw before a control step; eye height and velocity, which it ignores, are nominal."""
        arrays, names = self.arrays, tuple(o.name for o in self.episode.objects)
        hands = [None if i < 0 else names[i] for i in arrays["hands"][step]]
        return Observation(
            time=float(arrays["time"][step]),
            position=arrays["position"][step],
            heading=float(arrays["heading"][step]),
            pitch=float(arrays["pitch"][step]),
            eye=np.array([*arrays["position"][step], EYE_HEIGHT]),
            velocity=np.zeros(2),
            object_names=names,
            object_positions=arrays["object_position"][step],
            object_quaternions=arrays["object_quaternion"][step],
            object_status=tuple(STATUS[int(code)] for code in arrays["object_status"][step]),
            hands=(hands[0], hands[1]),
            busy=False,
        )

    def checkpoint_before(self, time: float) -> int | None:
        """Number of the last checkpoint at or before a time, s, or None where there is none."""
        steps = self.recorded.checkpoint_step
        times = self.arrays["time"][steps]
        return int(np.sum(times <= time + 1e-9)) - 1 if np.any(times <= time + 1e-9) else None


def load_run(directory: Path) -> RunRecord:
    """Read a run directory and check lengths and hashes.

    Raises:
        RecordError: It is no run directory.
        ReplayError: A file of it cannot be read at all, or is of another format version.
    """
    if not (directory / records.EVENTS).is_file():
        raise RecordError(f"{directory} is not a run directory: it has no {records.EVENTS}")
    log = (directory / records.EVENTS).read_bytes()
    start = _first_event(log)
    _check_format(directory, start)
    try:
        arrays = read_arrays(directory / records.TRAJECTORY)
        recorded = Recorded.load(directory / records.RECORDING)
        text = (directory / records.EPISODE).read_text(encoding="utf-8")
        episode = Episode.from_json(text)
        bad = sorted(
            n for n, d in {**PER_STEP, "unknown_objects": 1}.items() if n not in arrays or arrays[n].ndim != d
        )
        if bad:
            raise RecordError(f"{records.TRAJECTORY} lacks {', '.join(bad)}, or has them in another shape")
    except (RecordError, EpisodeError, OSError, UnicodeDecodeError) as error:
        raise ReplayError(f"{error}; the first bad step is 0", 0) from error
    faults = list(_faults(log, arrays, recorded))
    if hashlib.sha256(text.encode()).hexdigest() != start.get("episode_sha256"):
        faults.append(Fault(0, f"{records.EPISODE} is not the episode that was run"))
    first = min(faults, key=lambda fault: fault.step) if faults else None
    events = tuple(_events(log, recorded.log_size))
    return RunRecord(directory, start, events, episode, arrays, recorded, first)


def _first_event(log: bytes) -> Event:
    try:
        start = json.loads(log.split(b"\n", 1)[0])
        if isinstance(start, dict) and start.get("event") == "start":
            return start
    except ValueError:
        pass
    raise ReplayError(f"{records.EVENTS} does not begin with a start event; the first bad step is 0", 0)


def _check_format(directory: Path, start: Event) -> None:
    found, here = start.get("format"), records.LOG_FORMAT
    if found == here:
        return
    if isinstance(found, int) and found < here:
        raise ReplayError(
            f"{directory} has log format {found}, from before runs recorded state hashes and checkpoints (format "
            f"{here}), so there is nothing to verify a replay against; run the trial again with this version"
        )
    raise ReplayError(
        f"{directory} has log format {found!r}; this version replays format {here} only, "
        f"so use the version that wrote it: {start.get('versions', {}).get('mjsim', 'unknown')}"
    )


def _events(log: bytes, log_size: NDArray[np.int64]) -> Iterator[tuple[int, Event]]:
    """The events of a log, up to the first line that is none, each with its control step."""
    offset = 0
    for line in log.splitlines(keepends=True):
        try:
            event = json.loads(line)
        except ValueError:
            return
        if not isinstance(event, dict) or not {"t", "event"} <= set(event):
            return
        yield max(0, int(np.searchsorted(log_size[:-1], offset, side="right")) - 1), event
        offset += len(line)


def _faults(log: bytes, arrays: Mapping[str, NDArray[Any]], recorded: Recorded) -> Iterator[Fault]:
    steps = len(recorded.state_hash)
    lengths = {f"{records.TRAJECTORY}: {name}": len(arrays[name]) for name in PER_STEP}
    lengths[f"{records.RECORDING}: action_hash"] = len(recorded.action_hash)
    lengths[f"{records.RECORDING}: log_size"] = len(recorded.log_size) - 1
    lengths[f"{records.RECORDING}: log_hash"] = len(recorded.log_hash) - 1
    for name, length in lengths.items():
        if length != steps:
            yield Fault(
                max(0, min(length, steps)), f"{name} has {length} steps where the states have {steps}"
            )
    actions = arrays["action"][:steps]
    count = min(len(actions), len(recorded.action_hash))
    bad = np.flatnonzero(action_hashes(actions[:count]) != recorded.action_hash[:count])
    if bad.size:
        yield Fault(int(bad[0]), f"{records.TRAJECTORY}: the action is not the one that was recorded")
    yield from _log_faults(log, recorded)
    yield from _checkpoint_faults(recorded, steps)


def _log_faults(log: bytes, recorded: Recorded) -> Iterator[Fault]:
    """The first step whose share of the log is not what was written."""
    digest, done = LogDigest(), 0
    for step, (size, expected) in enumerate(zip(recorded.log_size.tolist(), recorded.log_hash, strict=False)):
        before, line = done, log[:done].count(10) + 1
        if size < done:
            yield Fault(max(0, step - 1), f"{records.RECORDING}: log_size goes backwards")
            return
        digest.update(log[done:size])
        done = size
        if size > len(log):
            what = f"is cut short: {len(log)} bytes, and more were written here"
        elif digest.hash != int(expected):
            last = line + max(0, log[before:size].count(10) - 1)
            what = f"is not as written, at line {line}" + (f" to {last}" if last > line else "")
        else:
            continue
        yield Fault(max(0, step - 1), f"{records.EVENTS} {what}")
        return
    if done != len(log):
        yield Fault(max(0, len(recorded.log_size) - 2), f"{records.EVENTS} goes on after its end")


def _checkpoint_faults(recorded: Recorded, steps: int) -> Iterator[Fault]:
    count = {len(getattr(recorded, f"checkpoint_{name}")) for name in ("step", "physics", "details", "hash")}
    if len(count) > 1 and len(recorded.checkpoint_step):
        yield Fault(
            int(recorded.checkpoint_step[min(count)]), f"{records.RECORDING}: checkpoints are missing"
        )
        return
    for number, step in enumerate(recorded.checkpoint_step.tolist()):
        if not 0 <= step < steps or not recorded.checkpoint_is_intact(number):
            bad = max(0, min(step, steps))
            yield Fault(bad, f"{records.RECORDING}: the checkpoint is not the one that was recorded")
