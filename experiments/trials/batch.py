"""Run a batch of trials in parallel. Finished trials are stored, so an interrupted batch can be resumed."""

import dataclasses
import functools
import gc
import os
import secrets
import shutil
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from experiments.errors import ConfigError
from experiments.house import House
from experiments.record.archive import WAIT_S, adopt, new_archive, pack
from experiments.record.run_directory import TRIALS, check_batch_folder, is_run
from experiments.session.signals import signals_postponed
from experiments.trials.batch_folder import StoredTrial, in_order, read_trial, trial_name, write_rows
from experiments.trials.batch_plan import BatchPlan, check_trials, plan_batch
from experiments.trials.design import Design, confounded
from experiments.trials.fingerprint import plugins
from experiments.trials.ray_workers import LostMachineError
from experiments.trials.shards import Shard
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from experiments.trials.trial_reader import UNSTAMPED, OnRead, TrialReader
from experiments.trials.workers import EXECUTORS, PROCESSES, RAY, Executor, Pools
from mjsim.house.compiled.house import MAX_HOUSES
from mjsim.support.files import remove_leftovers, work_folder

ExecutorContext = Callable[[Path], AbstractContextManager[Pools]]
RETRIES = 5  # number of times that a trial is rerun after losing its machine, before it is run alone


@dataclass(frozen=True)
class BatchProgress:
    """The progress of a batch in numbers of trials. `failure` describes the last error."""

    done: int
    resumed: int
    failed: int
    total: int
    failure: str | None = None


def run_batch(
    design: Design,
    out: Path,
    *,
    workers: int | None = None,
    executor: str = PROCESSES,
    packed: bool = False,
    shard: Shard | None = None,
    on_progress: Callable[[BatchProgress], None] = lambda _: None,
    on_note: Callable[[str], None] = lambda _: None,
    on_read: OnRead = lambda *_: None,
) -> list[Mapping[str, Any]]:
    """Run all trials of a design that have not been run yet, and write the result tables.

    Args:
        design: The trials.
        out: Folder of the batch. An existing batch is extended.
        workers: Number of trials that run in parallel (default: one per core of this machine or of the Ray cluster).
        executor: `processes` to use this machine, or `ray` to use a cluster whose machines share the folder.
        packed: Store the trials in archives, one per worker process, instead of run directories.
        shard: Part of the design to run. Only this part is read, and no tables are written.
        on_progress: Called at the start and after every trial.
        on_note: Called with messages for the user, for example about trials that are rerun or are missing.
        on_read: Called after each finished trial is read, with the number of trials read so far and the total number.

    Returns:
        A row for each trial in the folder or in the shard. The trials of the design come first, in its order.

    Raises:
        ConfigError: An argument is invalid, or a machine of the cluster cannot be used.
        ConnectionError: The connection to the Ray cluster is lost.
        ExperimentError, MjsimError, PlannerError, HudError: A trial cannot be run, so no trial was run.
        OSError: A table cannot be written.
    """
    if workers is not None and workers < 1:
        raise ConfigError(f"a batch needs at least one worker, got {workers}")
    if executor not in EXECUTORS:
        raise ConfigError(f"no executor {executor!r}; there are {', '.join(EXECUTORS)}")
    noted: set[str] = set()

    def note(line: str) -> None:
        if line not in noted:
            noted.add(line)
            on_note(line)

    out = out.absolute() if executor == RAY else out  # other machines have another current folder
    check_batch_folder(out)
    trials = design.trials if shard is None else shard.of(design).trials
    inputs = check_trials(trials)
    (out / TRIALS).mkdir(parents=True, exist_ok=True)
    label = "" if shard is None else shard.label
    adopt(out / TRIALS, label)  # renames archives that a killed batch has left behind
    own = None if shard is None else {trial_name(*trial) for trial in zip(trials, inputs, strict=True)}
    readers = workers or os.cpu_count() or 1
    reader = TrialReader(out, workers=readers, on_read=on_read, names=own, label=label)
    plan = plan_batch(trials, inputs, out, reader, label)
    for line in filter(None, (*plan.notes, confounded(trials) if shard is None else None)):
        note(line)
    archives = f"{label}{secrets.token_hex(4)}" if packed else None
    try:
        modules = sorted({module for config in plan.missing.values() for module in plugins(config)})
        workplace = functools.partial(EXECUTORS[executor], workers, modules, note)
        _run_missing(plan, workplace, archives, on_progress, reader)
    finally:
        with signals_postponed() as signals:
            signals.save()
            remove_leftovers(out / TRIALS)
            if archives is not None and adopt(out / TRIALS, archives, WAIT_S):
                note("a worker is still writing its archive; repeat the command to read its trials")
            changed = plan.missing or plan.notes
            found, unusable = reader.read() if changed else (plan.stored, plan.unusable)
            if shard is None:
                rows = write_rows(trials, out, found, unusable, note)
            else:
                rows = [trial.row for trial in in_order(trials, found)]
    return rows


def _run_missing(
    plan: BatchPlan,
    executor: ExecutorContext,
    archives: str | None,
    on_progress: Callable[[BatchProgress], None],
    reader: TrialReader,
) -> None:
    done = len(plan.done)
    progress = BatchProgress(done=0, resumed=done, failed=0, total=done + len(plan.missing))
    on_progress(progress)
    if not plan.missing:
        return
    for result in _results(plan.missing, executor, archives):
        if isinstance(result, str):
            field, failure = "failed", result
        else:
            field, failure = "done", None
            reader.add(result)
        count = getattr(progress, field) + 1
        progress = dataclasses.replace(progress, failure=failure, **{field: count})
        on_progress(progress)


def _results(
    missing: Mapping[Path, TrialConfig], executor: ExecutorContext, archives: str | None
) -> Iterator[StoredTrial | str]:
    by_house = sorted(missing.items(), key=lambda trial: trial[1].house)
    left = {path: config for path, config in by_house if not _died(path).exists()}
    alone = {path: config for path, config in missing.items() if path not in left}
    # The work folder is removed at the end, together with any files that killed processes have left in it.
    with work_folder(by_house[0][0].parent) as folder, executor(folder) as pools:
        run = functools.partial(_run, folder=folder, archives=archives)
        while left:
            with pools() as pool:
                yield from _together(pool, left, alone, run)
        for path, config in alone.items():
            again: dict[Path, TrialConfig] = {}
            with pools() as pool:
                yield from _together(pool, {path: config}, again, run)
            if again:
                yield f"{path.name}: its process died: it was killed, out of memory, or ended by custom code"
            else:
                _died(path).unlink(missing_ok=True)


def _died(path: Path) -> Path:
    """Return the path of a marker file for a trial that was running when a worker process died."""
    return path.with_name(f".{path.name}.died")


def _together(
    pool: Executor,
    left: dict[Path, TrialConfig],
    alone: dict[Path, TrialConfig],
    run: Callable[[TrialConfig, Path], StoredTrial | str],
) -> Iterator[StoredTrial | str]:
    running: dict[Future[StoredTrial | str], tuple[Path, TrialConfig]] = {}
    lost, usable = Counter[Path](), True
    while True:
        while usable and left and len(running) < pool.room:
            path, config = next(iter(left.items()))
            del left[path]
            try:
                running[pool.submit(run, config, path)] = path, config
            except BrokenProcessPool:
                left[path], usable = config, False
        if not running:
            return
        finished, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in finished:
            (path, config), error = running.pop(future), future.exception()
            if isinstance(error, ConfigError | ConnectionError):
                raise error
            if isinstance(error, LostMachineError) and lost[path] < RETRIES:
                lost[path], left[path] = lost[path] + 1, config
                continue
            if isinstance(error, BrokenProcessPool):
                alone[path] = config
                _died(path).touch()
                continue
            result = future.result() if error is None else _failure(error)
            if not isinstance(result, str) and result.stamp != UNSTAMPED and not path.exists():
                result = "its run directory is missing; all machines must share the folder of the batch"
            yield f"{path.name}: {result}" if isinstance(result, str) else result


@functools.lru_cache(MAX_HOUSES)
def _house(name: str) -> House:
    house = House.load(name)
    gc.freeze()
    return house


_archive = functools.cache(new_archive)  # every process writes its own archive


def _run(config: TrialConfig, out: Path, folder: Path, archives: str | None) -> StoredTrial | str:
    """Run a trial, pack it if `archives` is given, and read its result. Return any error as text."""
    with nullcontext(out.parent) if archives is None else work_folder(folder) as parent:
        run = parent / out.name
        try:
            try:
                house = _house(config.house)
                run_trial(config, run, topdown=False, replace=True, scratch=folder, house=house)
                trial = read_trial(run)
            finally:
                if archives is not None and is_run(run):
                    pack(run, _archive(out.parent, archives))
                    if is_run(out):  # left behind by an earlier, incomplete run
                        shutil.rmtree(out)
        except Exception as error:  # an error in one trial must not stop the others
            return _failure(error).replace(str(run), str(out))
    return trial if archives is None else msgspec.structs.replace(trial, path=out, stamp=UNSTAMPED)


def _failure(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"
