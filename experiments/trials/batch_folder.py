"""Read and write the folder of a batch, which has the following layout.

OUT/trials/NAME                  run directory of a trial
OUT/trials/ARCHIVE.sqlar         packed trials, many in one file
OUT/outdated/NAME                earlier results of trials that were rerun after a change of code or data
OUT/trials.parquet, trials.csv   one row per trial
OUT/.rows.jsonl.gz               cache of rows (`trial_reader`)
"""

import functools
import hashlib
import json
import os
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from experiments.errors import RecordError
from experiments.record import records
from experiments.record.archive import discard
from experiments.record.columns import HEALTH
from experiments.record.files import CHECKSUMS, read_arrays, read_checksums, read_json, sha256_of
from experiments.record.metrics import CIRCUMSTANCES, measure
from experiments.record.phases import COMPLETE
from experiments.record.records import Event, read_events
from experiments.record.run_directory import PACKED, TRIALS, free_name
from experiments.trials.design import confounded_rows, counted
from experiments.trials.fingerprint import Inputs, code_versions
from experiments.trials.table import write_tables
from experiments.trials.trial_config import DEFAULTS, SEEDS, SETTINGS, TrialConfig
from mjsim.house.catalogue.house_ref import parse_house

OUTDATED = "outdated"
MAX_NAME = 120  # maximum length of a trial name in characters, without seeds and hash
_SETTINGS = frozenset(SETTINGS)
CHECKED = (records.EVENTS, records.TRAJECTORY, records.EPISODE, records.RECORDING)

# Size in bytes and modification time in nanoseconds of each file of a trial, or None if it is missing
Stamp = tuple[tuple[int, int] | None, ...]


class StoredTrial(msgspec.Struct, frozen=True, array_like=True, dict=True):
    """A trial that is stored in a batch folder.

    Attributes:
        path: Run directory of the trial. If the trial is packed, the path that it would have when unpacked.
        row: Row of the result tables, computed from the log and the trajectory.
        as_measured: True if `metrics.json` agrees with the row.
        stamp: Sizes and modification times of the trial's files, taken before the files were read.
    """

    path: Path
    settings: dict[str, Any]
    inputs: dict[str, str]
    row: dict[str, Any]
    as_measured: bool
    stamp: Stamp

    @property
    def complete(self) -> bool:
        """True unless the trial failed or was interrupted and must therefore be rerun."""
        return self.row["ended"] in COMPLETE

    @functools.cached_property
    def key(self) -> str:
        return trial_key(self.settings)

    def is_in(self, house: str, inputs: Inputs) -> bool:
        """Return True if the trial was run in the given house or in a house with the same content."""
        return self.inputs["house"] == inputs["house"] or self.settings["house"] == house


def trial_key(settings: Mapping[str, Any]) -> str:
    """Return a key that is the same for all trials with equal settings, apart from the path of the house."""
    return json.dumps({name: settings[name] for name in sorted(settings) if name != "house"})


def read_trial(path: Path, *, recompute: bool = False) -> StoredTrial:
    """Read a trial and its metrics.

    If `metrics.json` has its original checksum and was written by the current versions of mjsim and its libraries,
    the metrics are read from it, which is five times faster. Otherwise, or if `recompute` is true, they are
    computed from the log and the trajectory.

    Raises:
        RecordError: A file is missing or was changed, or another version of mjsim has written it.
    """
    stamp = stamp_of(path)
    sums = read_checksums(path)
    for name in CHECKED:
        if sums.get(name) != sha256_of(path / name):
            raise RecordError(f"{path / name} is not as written")
    start = _start(path / records.EVENTS)
    if not set(start) >= _SETTINGS or "inputs" not in start:
        raise RecordError(f"{path} was made by another version of mjsim")
    settings, inputs = {name: start[name] for name in _SETTINGS}, start["inputs"]
    written = _metrics(path)
    current = written and inputs.items() >= _versions().items()
    if not recompute and current and sums.get(records.METRICS) == sha256_of(path / records.METRICS):
        return StoredTrial(path, settings, inputs, written, True, stamp)
    row = measure(
        read_events(path / records.EVENTS),
        read_arrays(path / records.TRAJECTORY, only=("time", "position", *HEALTH)),
    )
    as_measured = all(written.get(name) == value for name, value in json.loads(json.dumps(row)).items())
    row |= {name: written.get(name) for name in CIRCUMSTANCES}
    return StoredTrial(path, settings, inputs, row, as_measured, stamp)


_versions = functools.cache(code_versions)


def _start(path: Path) -> Event:
    """Read the start event of a log whose checksum is right."""
    try:
        with path.open("rb") as file:
            start = json.loads(file.readline())
    except ValueError as error:
        raise RecordError(f"{path}, line 1 is not JSON: {error}") from error
    if not isinstance(start, dict):
        raise RecordError(f"{path} does not begin with a start event")
    return start


def _metrics(path: Path) -> dict[str, Any]:
    try:
        written = read_json(path / records.METRICS)
    except RecordError:
        return {}
    return written if isinstance(written, dict) else {}


def stamp_of(path: Path) -> Stamp:
    """Return the sizes and modification times of a trial's files, or those of its archive if it is packed."""
    if path.parent.suffix == PACKED:
        return (_file_stamp(str(path.parent)),)
    return tuple(_file_stamp(f"{path}/{name}") for name in (CHECKSUMS, records.METRICS, *CHECKED))


def _file_stamp(path: str) -> tuple[int, int] | None:
    try:
        found = os.stat(path)  # noqa: PTH116 - faster than Path, and called six times per trial
    except OSError:
        return None
    return found.st_size, found.st_mtime_ns


def put_aside(out: Path, names: Collection[str], prefix: str = "") -> None:
    """Move trials to the `outdated` folder of a batch without overwriting earlier trials."""
    if names:
        (out / OUTDATED).mkdir(exist_ok=True)
        discard(out / TRIALS, names, out / OUTDATED, prefix)
    for name in sorted(names):
        if (out / TRIALS / name).exists():
            (out / TRIALS / name).rename(free_name(out / OUTDATED / name))


def trial_name(config: TrialConfig, inputs: Inputs) -> str:
    """Return a readable folder name, which is unique for each combination of settings and house."""
    is_custom = parse_house(config.house).kind == "folder"
    house = Path(config.house).parent.name if is_custom else config.house
    words = [house, f"{config.objects:02d}", config.assistance, config.user]
    words += [word for word in (config.planner, config.fidelity) if word not in (DEFAULTS["planner"], "full")]
    readable = re.sub(r"[^\w.+-]", ".", "-".join(words), flags=re.ASCII)[:MAX_NAME]
    seeds = [getattr(config, name) for name in SEEDS]
    numbers = f"{seeds[0]:04d}" if len(set(seeds)) == 1 else "-".join(f"{seed:04d}" for seed in seeds)
    identity = trial_key(config.settings()) + (inputs["house"] if is_custom else config.house)
    return f"{readable}-seed{numbers}-{hashlib.sha256(identity.encode()).hexdigest()[:8]}"


def write_rows(
    trials: Sequence[TrialConfig],
    out: Path,
    found: Sequence[StoredTrial],
    unusable: Mapping[Path, str],
    on_note: Callable[[str], None],
) -> list[Mapping[str, Any]]:
    """Write the result tables of a batch folder. Return the rows, starting with the trials of the design."""
    for note in folder_notes(found, unusable):
        on_note(note)
    rows: list[Mapping[str, Any]] = [trial.row for trial in in_order(trials, found)]
    if rows:
        write_tables(out, rows)
    return rows


def in_order(trials: Sequence[TrialConfig], found: Sequence[StoredTrial]) -> list[StoredTrial]:
    """Return all complete trials. The trials of the design come first, in the order of the design."""
    order = {trial_key(trial.settings()): number for number, trial in enumerate(trials)}
    complete = [trial for trial in found if trial.complete]
    return sorted(complete, key=lambda trial: (order.get(trial.key, len(order)), _sort_key(trial.settings)))


def _sort_key(settings: Mapping[str, Any]) -> list[Any]:
    return [settings[name] for name in ("objects", "assistance", "user", "house", *SEEDS)]


def folder_notes(trials: Sequence[StoredTrial], unusable: Mapping[Path, str]) -> Iterator[str]:
    """Yield warnings about trials that are missing from the tables or may not be comparable with others."""
    early = [trial for trial in trials if not trial.complete]
    if early:
        yield (
            f"left out of the tables as they ended early: {counted(len(early), 'trial')}, such as {early[0].path.name} "
            f"({early[0].row['ended']})"
        )
    trials = [trial for trial in trials if trial.complete]
    edited = [trial.path.name for trial in trials if not trial.as_measured]
    if edited:
        yield (
            f"metrics.json differs from the log in {counted(len(edited), 'trial')}, such as {edited[0]}; "
            "the tables follow the logs"
        )
    if unusable:
        yield f"left out of the tables: {counted(len(unusable), 'trial')}, such as: {next(iter(unusable.values()))}"
    makes = {json.dumps({k: v for k, v in t.inputs.items() if not _is_of_the_design(k)}) for t in trials}
    if len(makes) > 1:
        yield (
            f"the tables have trials of {len(makes)} versions of mjsim or its libraries (column fingerprint); "
            "run the whole design again to compare them"
        )
    if fault := confounded_rows([trial.row for trial in trials]):
        yield fault


def _is_of_the_design(name: str) -> bool:
    return name in ("house", "episode", "story") or name.startswith("module ")
