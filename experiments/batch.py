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
from experiments.lockstep import Play, drive_many, performer
from experiments.table import write_tables
from experiments.trial import TrialConfig, play_trial

TRIALS = "trials"
QUEUED_PER_WORKER = 2  # few, so that Ctrl-C has little to wait for
GROUP = 4  # trials of a task for each of its worlds

_Group = list[tuple[str, TrialConfig, Path]]


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
    worlds: int = 1,
    threads: int = 1,
    on_progress: Callable[[BatchProgress], None] = lambda _: None,
) -> list[dict[str, Any]]:
    """Run every trial of the design that `out` does not hold yet, then write the tables.

    Args:
        batch: The design.
        out: Folder of the batch; an earlier batch there is added to.
        workers: Processes.
        worlds: Trials that each of them runs side by side, a control step of all at a time. The records are the same,
            to the last bit, however many.
        threads: Threads of each process that step its worlds.
        on_progress: Called at the start and after every trial.

    Returns:
        The metrics of every trial of the design that succeeded, in the design's order.

    Raises:
        ConfigError: `workers`, `worlds` or `threads` is not positive.
        RecordError: A table cannot be written.
    """
    for what, count in (("worker", workers), ("world", worlds), ("thread", threads)):
        if count < 1:
            raise ConfigError(f"a batch needs at least one {what}, got {count}")
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
        groups = _groups(missing, folder, group_size(len(missing), workers, worlds))
        for failure in _results(pool, groups, workers, worlds, threads):
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


def group_size(trials: int, workers: int, worlds: int) -> int:
    """Trials in one task of a worker: so many that one can take the place of another that is over, but few enough
    that all workers have something to do."""
    return max(worlds, min(GROUP * worlds, trials // workers)) if worlds > 1 else 1


def _groups(trials: dict[str, TrialConfig], folder: Path, size: int) -> Iterator[_Group]:
    jobs = iter([(name, config, folder / name) for name, config in trials.items()])
    while group := list(itertools.islice(jobs, size)):
        yield group


def _results(
    pool: ProcessPoolExecutor, groups: Iterator[_Group], workers: int, worlds: int, threads: int
) -> Iterator[str | None]:
    """Submit a few groups at a time; yield None for each trial that succeeds, else what went wrong."""
    running: dict[Future[list[str | None]], _Group] = {}
    while True:
        for group in itertools.islice(groups, workers * QUEUED_PER_WORKER - len(running)):
            running[pool.submit(_run_group, group, worlds, threads)] = group
        if not running:
            return
        finished, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in finished:
            group = running.pop(future)
            error = future.exception()
            if error is None:
                yield from future.result()
            else:
                yield from (_failure(name, error) for name, _, _ in group)


@functools.cache
def _house(name: str) -> House:
    """One house per process, however many trials it runs there."""
    return House.load(name)


def _run_group(group: _Group, worlds: int, threads: int) -> list[str | None]:
    """Run trials, `worlds` of them side by side; None for each that succeeds, else what went wrong."""
    plays = ((name, _play(config, out)) for name, config, out in group)
    with performer(threads) as perform:
        return [
            _failure(name, result) if isinstance(result, Exception) else None
            for name, result in drive_many(plays, worlds, perform)
        ]


def _play(config: TrialConfig, out: Path) -> Play[dict[str, Any]]:
    return (yield from play_trial(config, out, topdown=False, house=_house(config.house)))


def _failure(name: str, error: BaseException) -> str:
    return f"{name}: {type(error).__name__}: {error}"


def _start_worker() -> None:
    """Leave Ctrl-C to the parent, and do not outlive it when it is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_exit_with, args=(parent.sentinel,), daemon=True).start()


def _exit_with(sentinel: int) -> None:
    multiprocessing.connection.wait([sentinel])
    os._exit(1)
