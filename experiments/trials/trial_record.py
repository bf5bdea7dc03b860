"""What a session left behind, written to a run directory: the record first, pictures last."""

import dataclasses
import os
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from experiments.errors import RecordError
from experiments.files import save_arrays, write_json
from experiments.house import House
from experiments.origin import origin_of
from experiments.runs import records
from experiments.runs.checksums import write_checksums
from experiments.runs.metrics import measure
from experiments.runs.recording import Recorded
from experiments.runs.records import Event, EventLog
from experiments.runs.run_directory import add_files, free_name
from experiments.session.session import Session
from experiments.session.user_code import describe
from mjsim.files import work_folder
from mjsim.model.scene import Scene

NOTHING_FILMED = "none: nothing was filmed"  # in place of the renderer's name


@dataclass(frozen=True, eq=False)
class SessionResult:
    """A session that is over.

    Attributes:
        arrays: The trajectory.
        recorded: Hashes and checkpoints.
        log: The event log; its last event says why it ended.
        error: What ended it, where that is an error.
        frames_sha256: Hash of the frames filmed, or None.
        renderer: What drew them.
        no_film: Why there is no film although one was wanted, or None.
    """

    arrays: Mapping[str, NDArray[Any]]
    recorded: Recorded
    log: EventLog
    error: Exception | None
    frames_sha256: str | None = None
    renderer: str = NOTHING_FILMED
    no_film: str | None = None

    @property
    def has_steps(self) -> bool:
        """Whether there is anything to keep."""
        return len(self.recorded.state_hash) > 0

    @classmethod
    def of_session(cls, session: Session, error: Exception | None, **film: str | None) -> "SessionResult":
        """The result of a session that ran here; `film` holds what is known of its film."""
        arrays = session.trajectory.arrays()
        return cls(arrays, session.recording.recorded(arrays["action"]), session.recording.log, error, **film)  # type: ignore[arg-type]

    @property
    def end(self) -> Event:
        """The last event."""
        return self.log.events[-1]

    @property
    def user(self) -> str:
        """Name of the participant."""
        return str(self.log.events[0]["user"])

    @property
    def plans(self) -> list[Event]:
        """Every plan that was logged."""
        return [event for event in self.log.events if event["event"] == "plan"]


def save_record(folder: Path, out: Path, scene: Scene, result: SessionResult, wall: float) -> dict[str, Any]:
    """Write the record of a session, and what it measured, to a run directory.

    Args:
        folder: The run directory.
        out: Where it will appear; named in errors.
        scene: The scene of the session.
        result: The session.
        wall: Time that the trial took, s.

    Returns:
        What `metrics.json` holds.

    Raises:
        RecordError: The folder cannot be written, and the record is kept elsewhere; the message says where.
    """
    try:
        return _write(folder, scene, result, wall)
    except OSError as error:
        shutil.rmtree(folder, ignore_errors=True)
        kept = _save_elsewhere(out, scene, result, wall)
        raise RecordError(f"cannot write {out} ({error.strerror}); the run is kept in {kept}") from error


def draw_floor_plan(run: Path, house: House, scene: Scene, result: SessionResult) -> str | None:
    """Add the floor plan to a run directory; why that was not possible, or None."""
    if not result.plans:
        return None
    try:
        from experiments.runs.topdown import draw_topdown  # matplotlib: batches do without

        origin = origin_of([result.user])
        with work_folder(Path(os.path.realpath(run)).parent) as folder:
            draw_topdown(folder / records.TOPDOWN, house, scene, result.plans[0], result.arrays, origin)
            add_files(folder, run)
    except Exception as error:  # no picture is worth a record
        return f"no floor plan: {describe(error)}"
    return None


def _write(folder: Path, scene: Scene, result: SessionResult, wall: float) -> dict[str, Any]:
    arrays = result.arrays
    scene.episode.save(folder / records.EPISODE)
    result.log.save(folder / records.EVENTS)
    save_arrays(folder / records.TRAJECTORY, arrays)
    result.recorded.save(folder / records.RECORDING)
    write_json(folder / records.PLAN, result.plans)
    metrics = {
        **measure(result.log.events, arrays),
        "frames_sha256": result.frames_sha256,
        "renderer": result.renderer,
        "wall_s": round(wall, 3),
    }
    write_json(folder / records.METRICS, metrics)  # a run directory with metrics is complete
    write_checksums(folder, records.FILES)
    return metrics


def _save_elsewhere(out: Path, scene: Scene, result: SessionResult, wall: float) -> Path:
    """Save a record that cannot be written where it should be among the temporary files.

    Raises:
        OSError: It cannot be written there either.
    """
    kept = free_name(Path(tempfile.gettempdir()) / f"mjsim-{out.name}")
    kept.mkdir()
    try:
        _write(kept, scene, dataclasses.replace(result, frames_sha256=None), wall)
    except OSError:
        shutil.rmtree(kept, ignore_errors=True)
        raise
    return kept
