"""Merge the shards of a batch: join their folders, write the tables, and find missing trials."""

import functools
import re
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from experiments.errors import RecordError
from experiments.record.archive import adopt, copy, opened_run, run_paths
from experiments.record.files import read_checksums
from experiments.record.run_directory import TRIALS, check_batch_folder, is_batch, is_run, link_or_copy
from experiments.trials.batch_folder import CHECKED, StoredTrial, put_aside, trial_key, write_rows
from experiments.trials.design import Design
from experiments.trials.shards import Shard, shard_numbers
from experiments.trials.trial_config import TrialConfig
from experiments.trials.trial_reader import UNSTAMPED, OnRead, TrialReader
from mjsim.generator.home_cache import load_catalogue
from mjsim.support.files import work_folder

_ROWS_OF = re.compile(r"\.rows\.\d+-of-(\d+)\..*")


@dataclass(frozen=True)
class Merged:
    """The result of merging the shards of a design.

    Attributes:
        rows: Rows of the tables, starting with the trials of the design.
        missing: Trials of the design that no folder contains.
        shards: Number of missing trials by shard. Empty if the number of shards is unknown.
    """

    rows: Sequence[Mapping[str, Any]]
    missing: Sequence[TrialConfig]
    shards: Mapping[Shard, int]


def merge_shards(
    design: Design,
    out: Path,
    parts: Iterable[Path],
    *,
    workers: int = 1,
    on_note: Callable[[str], None] = lambda _: None,
    on_read: OnRead = lambda *_: None,
) -> Merged:
    """Copy the trials of all shards to one folder, and write the result tables.

    Args:
        design: The whole design.
        out: Folder for all trials, which may already contain some of them.
        parts: Folders of the other shards, which are not changed.
        workers: Number of processes that read trials.
        on_note: Called with messages for the user.
        on_read: Called after each trial is read, with the number of trials read so far and the total number.

    Raises:
        RecordError: A part is not a batch folder, or two parts have different results for the same trial.
        OSError: The folder cannot be written.
    """
    check_batch_folder(out)
    others = [part for part in parts if part.resolve() != out.resolve()]
    for part in others:
        if not is_batch(part):
            raise RecordError(f"{part} is not the folder of a batch; name the --out of shards")
    (out / TRIALS).mkdir(parents=True, exist_ok=True)
    for folder in (out, *others):
        adopt(folder / TRIALS)  # renames archives that killed processes have left behind
    reader, *readers = (TrialReader(folder, workers=workers, on_read=on_read) for folder in (out, *others))
    chosen = {trial.path.name: trial for trial in reader.read()[0] if trial.complete}
    added: dict[Path, dict[str, StoredTrial]] = {}
    for part, part_reader in zip(others, readers, strict=True):
        for trial in (trial for trial in part_reader.read()[0] if trial.complete):
            first = chosen.setdefault(trial.path.name, trial)
            if first is trial:
                added.setdefault(part, {})[trial.path.name] = trial
            elif not _same(first.path, trial.path):
                raise RecordError(
                    f"{first.path} and {trial.path} are the same trial with different results; move one of them away"
                )
    for part, trials in added.items():
        _add(part, trials, out, reader)
    found, unusable = reader.read()
    rows = write_rows(design.trials, out, found, unusable, on_note)
    missing = _missing(design.trials, [trial for trial in found if trial.complete])
    return Merged(rows, missing, _shards(design.trials, missing, (out, *others)))


def _same(one: Path, other: Path) -> bool:
    """Return True if the records of two runs are equal except for their wall times."""
    with opened_run(one) as first, opened_run(other) as second:
        sums = read_checksums(first), read_checksums(second)
    return all(sums[0].get(name) == sums[1].get(name) for name in CHECKED)


def _add(part: Path, trials: Mapping[str, StoredTrial], out: Path, reader: TrialReader) -> None:
    trials_folder = out / TRIALS
    broken = {path.name for path in run_paths(trials_folder)}.intersection(trials)
    put_aside(out, broken)  # these runs are incomplete or damaged
    for name in (name for name in trials if is_run(part / TRIALS / name)):
        with work_folder(trials_folder) as work:
            shutil.copytree(part / TRIALS / name, work / name, copy_function=link_or_copy)
            (work / name).rename(trials_folder / name)
    copy(part / TRIALS, [name for name in trials if not (trials_folder / name).exists()], trials_folder)
    for name, trial in trials.items():
        stamp = trial.stamp if (trials_folder / name).exists() else UNSTAMPED
        reader.add(msgspec.structs.replace(trial, path=trials_folder / name, stamp=stamp))


def _missing(trials: Sequence[TrialConfig], stored: Iterable[StoredTrial]) -> list[TrialConfig]:
    catalogue = functools.cache(load_catalogue)
    by_key: dict[str, list[StoredTrial]] = {}
    for found in stored:
        by_key.setdefault(found.key, []).append(found)

    def is_there(trial: TrialConfig) -> bool:
        same = by_key.get(trial_key(trial.settings()), [])
        return any(found.settings["house"] == trial.house for found in same) or any(
            found.inputs["house"] == catalogue(trial.house).content for found in same
        )

    return [trial for trial in trials if not is_there(trial)]


def _shards(
    trials: Sequence[TrialConfig], missing: Iterable[TrialConfig], folders: Iterable[Path]
) -> dict[Shard, int]:
    files = Counter(
        int(match[1])
        for folder in folders
        for path in folder.iterdir()
        if (match := _ROWS_OF.fullmatch(path.name))
    )
    if not files:
        return {}
    ((count, _),) = files.most_common(1)
    number = dict(zip(trials, shard_numbers(trials, count), strict=True))
    found = Counter(number[trial] for trial in missing)
    return {Shard(k, count): found[k] for k in sorted(found)}
