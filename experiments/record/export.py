"""Writes the run directory of a session: its record, and what follows from it."""

import shutil
import tempfile
from pathlib import Path
from typing import Any

from experiments.errors import RecordError
from experiments.record import records
from experiments.record.files import save_arrays, write_checksums, write_json
from experiments.record.metrics import measure
from experiments.record.reader import Record
from experiments.record.run_directory import free_name
from mjsim.support.files import replacing

NOTHING_FILMED = "none: nothing was filmed"  # in place of the renderer's name


def save_record(
    folder: Path,
    out: Path,
    record: Record,
    wall: float,
    *,
    frames_sha256: str | None = None,
    renderer: str = NOTHING_FILMED,
) -> dict[str, Any]:
    """Write the record of a session and its metrics to a folder that will appear at `out`; returns the metrics.

    Args:
        folder: The folder.
        out: The run directory.
        record: The record.
        wall: Time that the trial took, s.
        frames_sha256: Hash of the filmed frames, or None.
        renderer: What drew them.

    Raises:
        RecordError: The folder cannot be written, and the record is kept elsewhere; the message says where.
        OSError: The folder cannot be written, and the record is that of a journal, which still holds it.
    """
    metrics = {
        **measure(record.events, record.trajectory),
        "frames_sha256": frames_sha256,
        "renderer": renderer,
        "wall_s": round(wall, 3),
    }
    try:
        _write(folder, record, metrics)
    except OSError as error:
        if record.participant is not None:  # of a journal, which keeps it
            raise
        shutil.rmtree(folder, ignore_errors=True)
        metrics["frames_sha256"] = None
        kept = _save_elsewhere(out, record, metrics)
        raise RecordError(f"cannot write {out} ({error.strerror}); the run is kept in {kept}") from error
    return metrics


def _write(folder: Path, record: Record, metrics: dict[str, Any]) -> None:
    record.episode.save(folder / records.EPISODE)
    with replacing(folder / records.EVENTS) as path:
        path.write_bytes(record.log)
    played = record.participant is not None  # for many minutes; a batch has many short trials
    save_arrays(folder / records.TRAJECTORY, record.trajectory, small=played)
    save_arrays(folder / records.RECORDING, record.recording, small=played)
    write_json(folder / records.PLAN, record.plans)
    write_json(folder / records.METRICS, metrics)  # a run directory with metrics is complete
    write_checksums(folder, records.FILES)


def _save_elsewhere(out: Path, record: Record, metrics: dict[str, Any]) -> Path:
    """Save a record that cannot be written where it should be among the temporary files.

    Raises:
        OSError: It cannot be written there either.
    """
    kept = free_name(Path(tempfile.gettempdir()) / f"mjsim-{out.name}")
    kept.mkdir()
    try:
        _write(kept, record, metrics)
    except OSError:
        shutil.rmtree(kept, ignore_errors=True)
        raise
    return kept
