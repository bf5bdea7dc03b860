"""Measure the time and memory needed to resume a batch, to analyse it, and to collect a large study.

Thousands of trial records are copied from 100 real ones, with changed seeds, names, fingerprints and
checksums. The benchmark measures the CPU time of a command with its workers, and the peak memory of its
largest process.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from benchmarks.support.grown_people import fill_study
from benchmarks.support.grown_records import batch_words, grow_batch, real_trials
from benchmarks.support.requirements import Requirement, requirement_lines
from experiments.errors import ConfigError
from experiments.trials.batch_folder import OUTDATED
from experiments.trials.table import NAME, read_rows

TRIALS, PEOPLE, REAL = 16_000, 10_000, 100
QUICK = 40  # factor by which a quick run reduces the number of records
BATCH = "batch"
REQUIREMENTS = {
    "resume": (Requirement("processor time, s", "processor_s", "<", 10.0),),
    "analyze": (
        Requirement("processor time, s", "processor_s", "<", 60.0),
        Requirement("memory, MB", "memory_mb", "<", 2000.0),
    ),
    "collect": (Requirement("processor time, s", "processor_s", "<", 30.0),),
}


def measure(
    *,
    parts: Sequence[str] = (),
    quick: bool = False,
    count: int = 0,
    workers: int = 1,
    out: Path | None = None,
) -> dict[str, Any]:
    """Run all or some parts of the benchmark and return a JSON-serializable result.

    Args:
        parts: Names of the parts to run (all by default).
        quick: True to use only 400 trials, 250 participants and 10 real trials.
        count: Even number of trials and participants that replaces the defaults of 16,000 and 10,000.
        workers: Number of processes of a batch.
        out: Folder in which the real trials are kept for later runs.

    Raises:
        ConfigError: There is no such part, or the number is odd.
    """
    measures = {"resume": _resume, "analyze": _analyze, "collect": _collect}
    for name in parts:
        if name not in measures:
            raise ConfigError(f"benchmark growth has no part {name!r}; there are {', '.join(measures)}")
    if count % 2:
        raise ConfigError(f"--count {count} must be even; half of the trials have assistance")
    shrink = QUICK if quick else 1
    sizes = {"trials": count or TRIALS // shrink, "people": count or PEOPLE // shrink}
    result: dict[str, Any] = {}
    with (
        nullcontext(out) if out is not None else tempfile.TemporaryDirectory(prefix="mjsim-growth-") as folder
    ):
        work = Path(folder)
        _fresh(work / BATCH)  # an earlier run may have used other code
        real = real_trials(REAL // 10 if quick else REAL, work / "real", workers)
        for name in parts or measures:
            print(f"{name}: begins", file=sys.stderr, flush=True)
            result[name] = measures[name](work, real, sizes, workers)
    return result


def lines(result: Mapping[str, Any]) -> Iterator[str]:
    for name, requirements in REQUIREMENTS.items():
        if name in result:
            found = result[name]
            yield (
                f"{name} of {found['records']} {found['of']}: {found['processor_s']:.1f} s of a core, "
                f"{found['memory_mb']:.0f} MB"
            )
            if "first_s" in found:
                yield f"{name}, where nothing was read before: {found['first_s']:.1f} s of a core"
            yield from requirement_lines(found, requirements)


def _resume(work: Path, real: Any, sizes: Mapping[str, int], workers: int) -> dict[str, Any]:
    trials, batch = sizes["trials"], _batch(work, real, sizes)
    words = [*batch_words(trials, batch), "--workers", str(workers)]
    first = _run(words)
    again = _run(words)
    rows = read_rows(batch / f"{NAME}.parquet")
    if len(rows) != trials or (batch / OUTDATED).exists():
        raise RuntimeError(f"{batch} was not recognised as finished: {len(rows)} rows of {trials}")
    return {"records": trials, "of": "finished trials", "first_s": first["processor_s"], **again}


def _analyze(work: Path, real: Any, sizes: Mapping[str, int], workers: int) -> dict[str, Any]:
    batch = _batch(work, real, sizes)
    if not (batch / f"{NAME}.parquet").is_file():
        _run([*batch_words(sizes["trials"], batch), "--workers", str(workers)])
    return {
        "records": sizes["trials"],
        "of": "trials",
        **_run(["study", "analyze", str(batch), "--out", str(_fresh(work / "analysis"))]),
    }


def _collect(work: Path, real: Any, sizes: Mapping[str, int], _: int) -> dict[str, Any]:
    people, folder = sizes["people"], _fresh(work / "study")
    file, table = fill_study(folder, real, people), folder / "table"
    figures = _run(["study", "collect", str(file), str(folder), "--out", str(table)])
    if (rows := len(read_rows(table / f"{NAME}.parquet"))) != people:
        raise RuntimeError(f"{table} has {rows} rows of {people} people")
    return {"records": people, "of": "people", **figures}


def _batch(work: Path, real: Any, sizes: Mapping[str, int]) -> Path:
    """Return the folder of the batch. Create the batch on the first call."""
    batch = work / BATCH
    if not batch.is_dir():
        grow_batch(real, sizes["trials"], batch)
    return batch


def _fresh(folder: Path) -> Path:
    shutil.rmtree(folder, ignore_errors=True)
    return folder


def _run(words: Sequence[str]) -> dict[str, float]:
    """Run an mjsim command. Return its total CPU time and the peak memory of its largest process."""
    process = subprocess.Popen([sys.executable, "-m", "mjsim", *words], stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"mjsim {' '.join(words)} ended with {process.returncode}")
    return {"processor_s": used.ru_utime + used.ru_stime, "memory_mb": used.ru_maxrss / 1024}
