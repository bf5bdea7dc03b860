"""Many trials on all cores. Each finished trial is a run directory, so a killed batch goes on where it stopped."""

import dataclasses
import functools
import itertools
import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments import records
from experiments.errors import ConfigError
from experiments.files import read_json
from experiments.house import House
from experiments.table import write_tables
from experiments.trial import TrialConfig, run_trial

TRIALS = "trials"
QUEUED_PER_WORKER = 2  # few, so that Ctrl-C has little to wait for

_Job = tuple[str, TrialConfig, Path]


@dataclass(frozen=True)
class BatchConfig:
    """A full factorial design.

    Attributes:
        objects: Difficulties.
        assistance: Assistance conditions.
        seeds: Seeds.
        user: Participant, or None for the one that makes the most of each condition.
        house: House name, or path of a catalogue.
        planner: Solver of the routing problem.
        fidelity: How much of the world is physics.
        regret: Judge every visit.
    """

    objects: Sequence[int]
    assistance: Sequence[str]
    seeds: Sequence[int]
    user: str | None = None
    house: str = "apartment"
    planner: str = TrialConfig.planner
    fidelity: str = TrialConfig.fidelity
    regret: bool = True

    def __post_init__(self) -> None:
        for name in ("objects", "assistance", "seeds"):
            values = getattr(self, name)
            if not values:
                raise ConfigError(f"a batch needs at least one value for --{name}")
            if len(set(values)) != len(values):
                raise ConfigError(f"--{name} names a value twice: {list(values)}")

    def trials(self) -> Iterator[TrialConfig]:
        """Every cell of the design, seeds innermost."""
        for objects, assistance, seed in itertools.product(self.objects, self.assistance, self.seeds):
            yield TrialConfig(
                objects=objects,
                assistance=assistance,
                seed=seed,
                user=self.user,
                house=self.house,
                planner=self.planner,
                fidelity=self.fidelity,
                regret=self.regret,
            )


@dataclass(frozen=True)
class BatchProgress:
    """How far a batch has got: trials done now and earlier, failed, and in all; the message of the latest failure."""

    done: int
    resumed: int
    failed: int
    total: int
    failure: str | None = None


def trial_name(config: TrialConfig) -> str:
    """Folder name of a trial: unlike configurations of one batch have unlike names."""
    user = config.user_name.replace(":", ".").replace("/", ".")
    house = Path(config.house).parent.name if "/" in config.house else config.house
    assistance = config.assistance.replace(":", ".")
    fidelity = "" if config.fidelity == TrialConfig.fidelity else f"-{config.fidelity}"
    return (
        f"{house}-{config.objects:02d}-{assistance}-{user}-{config.planner}{fidelity}-seed{config.seed:04d}"
    )


def run_batch(
    batch: BatchConfig,
    out: Path,
    *,
    workers: int,
    on_progress: Callable[[BatchProgress], None] = lambda _: None,
) -> list[dict[str, Any]]:
    """Run every trial of the design that `out` does not hold yet, then write the tables.

    Args:
        batch: The design.
        out: Folder of the batch; an earlier batch there is added to.
        workers: Processes.
        on_progress: Called at the start and after every trial.

    Returns:
        The metrics of every trial of the design that succeeded, in the design's order.

    Raises:
        ConfigError: `workers` is not positive.
        RecordError: A table cannot be written.
    """
    if workers < 1:
        raise ConfigError(f"a batch needs at least one worker, got {workers}")
    trials = {trial_name(config): config for config in batch.trials()}
    folder = out / TRIALS
    folder.mkdir(parents=True, exist_ok=True)
    missing = {
        name: config for name, config in trials.items() if not (folder / name / records.METRICS).is_file()
    }
    progress = BatchProgress(done=0, resumed=len(trials) - len(missing), failed=0, total=len(trials))
    on_progress(progress)
    # Spawned, not forked: a forked GL or thread-pool state would not survive.
    pool = ProcessPoolExecutor(
        workers, mp_context=multiprocessing.get_context("spawn"), initializer=_start_worker
    )
    try:
        jobs = ((name, config, folder / name) for name, config in missing.items())
        for failure in _results(pool, jobs, workers):
            if failure is None:
                progress = dataclasses.replace(progress, done=progress.done + 1, failure=None)
            else:
                progress = dataclasses.replace(progress, failed=progress.failed + 1, failure=failure)
            on_progress(progress)
    finally:
        pool.shutdown(cancel_futures=True)
        rows = [
            read_json(folder / n / records.METRICS)
            for n in trials
            if (folder / n / records.METRICS).is_file()
        ]
        if rows:
            write_tables(out, rows)
    return rows


def _results(pool: ProcessPoolExecutor, jobs: Iterator[_Job], workers: int) -> Iterator[str | None]:
    """Submit a few trials at a time; yield None for each one that succeeds, else what went wrong."""
    running: dict[Future[str | None], str] = {}
    while True:
        for name, config, out in itertools.islice(jobs, workers * QUEUED_PER_WORKER - len(running)):
            running[pool.submit(_run, config, out)] = name
        if not running:
            return
        finished, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in finished:
            name, error = running.pop(future), future.exception()
            failure = future.result() if error is None else _failure(error)
            yield None if failure is None else f"{name}: {failure}"


@functools.cache
def _house(name: str) -> House:
    """One house per process, however many trials it runs there."""
    return House.load(name)


def _run(config: TrialConfig, out: Path) -> str | None:
    """Run a trial; None if it succeeds, else what went wrong, as text: not every exception survives pickling."""
    try:
        run_trial(config, out, topdown=False, house=_house(config.house))
    except Exception as error:  # whatever goes wrong in one trial, the others go on
        return _failure(error)
    return None


def _failure(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"


def _start_worker() -> None:
    """Leave Ctrl-C to the parent, and do not outlive it when it is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_exit_with, args=(parent.sentinel,), daemon=True).start()


def _exit_with(sentinel: int) -> None:
    multiprocessing.connection.wait([sentinel])
    os._exit(1)
