"""Many trials on all cores. Each finished trial is a run directory, so a killed batch continues where it stopped."""

import dataclasses
import functools
import itertools
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments import records
from experiments.design import Design
from experiments.endings import COMPLETE
from experiments.errors import ConfigError
from experiments.files import read_json
from experiments.house import House
from experiments.run_directory import TRIALS, check_batch_folder
from experiments.signals import signals_postponed
from experiments.table import write_tables
from experiments.trial import run_trial
from experiments.trial_config import TrialConfig
from experiments.workers import worker_pool
from mjsim.files import remove_leftovers

QUEUED_PER_WORKER = 2  # few, so that Ctrl-C has little to wait for


@dataclass(frozen=True)
class BatchProgress:
    """Progress of a batch.

    Attributes:
        done: Trials done in this call.
        resumed: Trials that an earlier call had done.
        failed: Trials that failed in this call.
        total: Trials of the design.
        failure: What failed in the latest trial, or None.
    """

    done: int
    resumed: int
    failed: int
    total: int
    failure: str | None = None


def trial_name(config: TrialConfig) -> str:
    """Folder name of a trial; different configurations of one batch have different names."""
    house = Path(config.house).parent.name if "/" in config.house else config.house
    parts = [house, f"{config.objects:02d}", config.assistance, config.user, config.planner]
    if config.fidelity != TrialConfig.fidelity:
        parts.append(config.fidelity)
    return "-".join([*parts, f"seed{config.house_seed:04d}"]).replace(":", ".").replace("/", ".")


def run_batch(
    design: Design,
    out: Path,
    *,
    workers: int,
    on_progress: Callable[[BatchProgress], None] = lambda _: None,
) -> list[dict[str, Any]]:
    """Run every trial of the design that `out` does not hold yet, then write the tables.

    Args:
        design: Which trials.
        out: Folder of the batch; an earlier batch there is added to.
        workers: Processes.
        on_progress: Called at the start and after every trial.

    Returns:
        The metrics of every trial of the design that succeeded, in the design's order.

    Raises:
        ConfigError: `workers` is below 1.
        OSError: A table cannot be written, or a worker was killed.
    """
    if workers < 1:
        raise ConfigError(f"a batch needs at least one worker, got {workers}")
    folders = {out / TRIALS / trial_name(config): config for config in design.trials}
    check_batch_folder(out)
    missing = [(path, config) for path, config in folders.items() if not _is_done(path)]
    progress = BatchProgress(done=0, resumed=len(folders) - len(missing), failed=0, total=len(folders))
    on_progress(progress)
    try:
        with worker_pool(max(1, min(workers, len(missing)))) as pool:
            for failure in _results(pool, iter(missing), workers):
                field = "done" if failure is None else "failed"
                count = getattr(progress, field) + 1
                progress = dataclasses.replace(progress, failure=failure, **{field: count})
                on_progress(progress)
    finally:
        with signals_postponed() as signals:
            signals.save()
            remove_leftovers(out / TRIALS)
            rows = [read_json(path / records.METRICS) for path in folders if _is_done(path)]
            if rows:
                write_tables(out, rows)
    return rows


def _is_done(path: Path) -> bool:
    """Whether a trial was run to its end; one that failed or was interrupted is run again."""
    metrics = path / records.METRICS
    return metrics.is_file() and read_json(metrics).get("ended") in COMPLETE


def _results(
    pool: ProcessPoolExecutor, jobs: Iterator[tuple[Path, TrialConfig]], workers: int
) -> Iterator[str | None]:
    """Submit a few trials at a time; yield None for each one that succeeds, else what went wrong."""
    running: dict[Future[str | None], str] = {}
    while True:
        for path, config in itertools.islice(jobs, workers * QUEUED_PER_WORKER - len(running)):
            running[pool.submit(_run, config, path)] = path.name
        if not running:
            return
        finished, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in finished:
            name, error = running.pop(future), future.exception()
            failure = future.result() if error is None else _failure(error)
            yield None if failure is None else f"{name}: {failure}"


@functools.cache
def _house(name: str) -> House:
    """Loaded once per process."""
    return House.load(name)


def _run(config: TrialConfig, out: Path) -> str | None:
    """Run a trial; None if it succeeds, else the error as text, because not every exception can be pickled."""
    try:
        run_trial(config, out, topdown=False, replace=True, house=_house(config.house))
    except Exception as error:  # an error in one trial must not stop the others
        return _failure(error)
    return None


def _failure(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"
