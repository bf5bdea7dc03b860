"""Reads a run directory for a replay, and checks all that can be checked without physics."""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.errors import RecordError, ReplayError
from experiments.files import TEXT, Layout, read_arrays
from experiments.replaying.record_checks import (
    ROWS,
    Mismatch,
    check_arrays,
    check_checkpoints,
    check_log_hashes,
)
from experiments.runs import records
from experiments.runs.event_checks import check_event
from experiments.runs.recording import Recorded
from experiments.runs.records import Event
from experiments.runs.trajectory import STATUS_CODE, decode_action
from experiments.session.endings import COMPLETE, PHYSICS_ERROR
from mjsim.actions import Action, EventKind
from mjsim.episode import Episode
from mjsim.errors import EpisodeError, PersonError
from mjsim.observation import Observation
from mjsim.person_parameters import PersonParameters

STATUS = {code: status for status, code in STATUS_CODE.items()}
EXTERNAL = ("scroll", "overrun", "pause", "resume", "blur")  # events that come from outside of the simulation
WORLD_EVENTS = {kind.value: kind for kind in EventKind}


@dataclass(frozen=True, eq=False)
class RunRecord:
    """The record of a run.

    Attributes:
        directory: The run directory.
        start: The first event of the log: configuration, versions, fingerprints.
        events: The events up to the first line that cannot be read, each with the control step that logged it.
        person: The participant, with every value that was drawn.
        episode: The disorganized house.
        arrays: The trajectory.
        recorded: Hashes and checkpoints.
        mismatch: The first mismatch that was found without physics, or None.
    """

    directory: Path
    start: Event
    events: tuple[tuple[int, Event], ...]
    person: PersonParameters
    episode: Episode
    arrays: Mapping[str, NDArray[Any]]
    recorded: Recorded
    mismatch: Mismatch | None

    @property
    def steps(self) -> int:
        """Number of recorded control steps, including the final state."""
        return len(self.recorded.state_hash)

    @property
    def reason(self) -> str | None:
        """Why the run ended, or None where its log is cut short."""
        last = self.events[-1][1]
        return str(last.get("reason")) if last["event"] == "end" else None

    @property
    def broke_off(self) -> bool:
        """Whether the run was ended in the middle of a control step, which is then not simulated again."""
        return self.reason not in (*COMPLETE, PHYSICS_ERROR)

    def action(self, step: int) -> Action:
        """The action of a control step; raises `RecordError` if the row is not an action."""
        names = [o.name for o in self.episode.objects]
        return decode_action(self.arrays["action"][step], [*names, *map(str, self.arrays["unknown_objects"])])

    def moves(self, first: int, end: int) -> NDArray[np.float64]:
        """The moves from control step `first` to `end`, or to the first other action; m/s and rad/s, shape (n, 4)."""
        rows = self.arrays["action"][first:end]
        others = np.flatnonzero((rows[:, 0] != 0.0) | ~np.isfinite(rows).all(axis=1))
        return rows[: others[0] if others.size else len(rows), 2:]

    def next_event(self, first: int) -> int | None:
        """The first control step from `first` on that has an event of the world; None if there is none."""
        return next((s for s, e in self.events if s >= first and e["event"] in WORLD_EVENTS), None)

    def observation(self, step: int) -> Observation:
        """The state before a control step; eye height and velocity are nominal, as the assistant ignores them."""
        arrays, names = self.arrays, tuple(o.name for o in self.episode.objects)
        hands = [None if i < 0 else names[i] for i in arrays["hands"][step]]
        return Observation(
            time=float(arrays["time"][step]),
            position=arrays["position"][step],
            heading=float(arrays["heading"][step]),
            pitch=float(arrays["pitch"][step]),
            eye=np.array([*arrays["position"][step], self.person.eye_height]),
            velocity=np.zeros(2),
            object_names=names,
            object_positions=arrays["object_position"][step],
            object_quaternions=arrays["object_quaternion"][step],
            object_status=tuple(STATUS[int(code)] for code in arrays["object_status"][step]),
            hands=(hands[0], hands[1]),
            busy=False,
        )

    def checkpoint_before(self, time: float) -> int | None:
        """Index of the last checkpoint at or before a time, s, or None."""
        steps = self.recorded.checkpoint_step
        steps = steps[(steps >= 0) & (steps < len(self.arrays["time"]))]
        count = int(np.sum(self.arrays["time"][steps] <= time + 1e-9))
        return count - 1 if count else None


def check_log(directory: Path) -> None:
    """Whether the log of a run has the format of this version, and every line is an event with the fields of its kind.

    Raises:
        RecordError: It is not a run directory, or a line is no event.
        ReplayError: The log has the format of another version.
    """
    log = _read_log(directory)
    _check_format(directory, _first_event(log))
    for number, line in enumerate(log.splitlines(), start=1):
        try:
            check_event(line)
        except RecordError as error:
            raise RecordError(f"{directory / records.EVENTS}, line {number}: {error}") from error


def load_run(directory: Path) -> RunRecord:
    """Read a run directory and check lengths and hashes.

    Raises:
        RecordError: It is not a run directory.
        ReplayError: A file cannot be read, or has the log format of another version.
    """
    log = _read_log(directory)
    start = _first_event(log)
    _check_format(directory, start)
    try:
        check_event(log.split(b"\n", 1)[0])
        episode = Episode.load(directory / records.EPISODE)
        text = (directory / records.EPISODE).read_text(encoding="utf-8")
        arrays = read_arrays(directory / records.TRAJECTORY, _layouts(len(episode.objects)))
        recorded = Recorded.load(directory / records.RECORDING)
    except (RecordError, EpisodeError, OSError, UnicodeDecodeError) as error:
        raise ReplayError(f"{directory}: {error}; the first bad step is 0", 0) from error
    mismatches = [
        *check_arrays(arrays, recorded),
        *check_log_hashes(log, recorded),
        *check_checkpoints(recorded),
    ]
    if hashlib.sha256(text.encode()).hexdigest() != start.get("episode_sha256"):
        wrong = f"{records.EPISODE} is not the episode that was run"
        mismatches.append(Mismatch(0, wrong, records.EPISODE))
    events, malformed = _events(log, recorded.log_size)
    mismatches += [*malformed, *_check_settings(start, episode)]
    first = min(mismatches, key=lambda mismatch: mismatch.step, default=None)
    return RunRecord(directory, start, tuple(events), _person(events), episode, arrays, recorded, first)


def _layouts(objects: int) -> dict[str, Layout]:
    rows = {
        name: (kind, (None, *(objects if size is None else size for size in row)))
        for name, (kind, row) in ROWS.items()
    }
    return {**rows, "unknown_objects": (TEXT, (None,))}


def _person(events: Sequence[tuple[int, Event]]) -> PersonParameters:
    """The participant; the hashes of the log protect it."""
    logged = next((event for _, event in events if event["event"] == records.PARTICIPANT), None)
    try:
        if logged is None:
            raise PersonError("no event describes the participant")
        return PersonParameters.from_dict(logged["person"])
    except (PersonError, KeyError, TypeError) as error:
        raise ReplayError(f"{records.EVENTS}: {error}; the first bad step is 0", 0) from error


def _read_log(directory: Path) -> bytes:
    if not (directory / records.EVENTS).is_file():
        raise RecordError(f"{directory} is not a run directory: it has no {records.EVENTS}")
    return (directory / records.EVENTS).read_bytes()


def _first_event(log: bytes) -> Event:
    try:
        start = json.loads(log.split(b"\n", 1)[0])
        if isinstance(start, dict) and start.get("event") == "start":
            return start
    except (ValueError, RecursionError):
        pass
    raise ReplayError(f"{records.EVENTS} does not begin with a start event; the first bad step is 0", 0)


def _check_format(directory: Path, start: Event) -> None:
    found = start.get("format")
    if found != records.LOG_FORMAT:
        versions = start.get("versions")
        version = versions.get("mjsim", "unknown") if isinstance(versions, dict) else "unknown"
        raise ReplayError(
            f"{directory} has log format {found!r} of mjsim {version}; this version replays format "
            f"{records.LOG_FORMAT} only: replay it with the version that wrote it, or run the trial again"
        )


def _events(log: bytes, log_size: NDArray[np.int64]) -> tuple[list[tuple[int, Event]], list[Mismatch]]:
    """The events up to the first malformed line, each with the control step that logged it; what is malformed."""
    events: list[tuple[int, Event]] = []
    offset = 0
    for number, line in enumerate(log.splitlines(keepends=True), start=1):
        step = max(0, int(np.searchsorted(log_size[:-1], offset, side="right")) - 1)
        try:
            check_event(line)
            events.append((step, json.loads(line)))
        except (RecordError, ValueError) as error:
            return events, [Mismatch(step, f"line {number}: {error}", records.EVENTS)]
        offset += len(line)
    return events, []


def _check_settings(start: Event, episode: Episode) -> Iterator[Mismatch]:
    """Whether the start event is about this episode."""
    names = [placed.name for placed in episode.objects]
    for what, wrong in (
        (
            f"{start.get('objects')!r} objects, the episode has {len(names)}",
            start.get("objects") != len(names),
        ),
        ("an order of other objects than the episode's", sorted(start.get("order", ())) != sorted(names)),
    ):
        if wrong:
            yield Mismatch(0, f"{records.EVENTS}: the start event has {what}", records.EVENTS)
