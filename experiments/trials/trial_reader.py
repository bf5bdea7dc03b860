"""Read the trials of a batch folder, and cache their results.

Table rows are cached in OUT/.rows.jsonl.gz, or in a separate file for each shard, together with the sizes and
modification times of the files of the trial. A trial is read again if its files or the code of mjsim have
changed. The cache may be deleted at any time.
"""

import gzip
import zlib
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from pathlib import Path

import msgspec
from msgspec.structs import replace

from experiments.errors import RecordError
from experiments.record.archive import opened_run, run_paths
from experiments.record.run_directory import PACKED, TRIALS
from experiments.trials.batch_folder import Stamp, StoredTrial, read_trial, stamp_of
from experiments.trials.fingerprint import CODE
from experiments.trials.workers import worker_pool
from mjsim.support.files import replacing, source_digest

ROWS = ".rows.jsonl.gz"
UNSTAMPED: Stamp = ()
POOL_FROM = 500  # minimum number of unread trials for which worker processes save time

OnRead = Callable[[int, int], None]  # called with the number of trials read so far and the total number


_ENCODER = msgspec.json.Encoder(enc_hook=lambda path: path.name)  # the cache contains no folders


class TrialReader:
    """A reader for the trials in a batch folder, with a cache in the same folder.

    Args:
        out: The batch folder.
        workers: Number of processes that read trials.
        on_read: Called after each trial is read.
        names: Names of the trials that a shard reads, or None for all trials.
        label: Label of a shard, which is part of the names of all its files, so that shards share no files.
    """

    def __init__(
        self,
        out: Path,
        *,
        workers: int = 1,
        on_read: OnRead = lambda *_: None,
        names: Collection[str] | None = None,
        label: str = "",
    ) -> None:
        self._trials, self._file = out / TRIALS, out / _rows_file(label)
        self._names, self._label = names, label
        self._workers, self._on_read = workers, on_read
        files = [self._file] if names is not None else sorted(out.glob(_rows_file("*")))
        self._known = {trial.path.name: trial for file in files for trial in _load(file, self._trials)}
        self._saved = dict(self._known)

    def add(self, trial: StoredTrial) -> None:
        """Add a trial that was read by another process. If it was packed later, its stamp is `UNSTAMPED`."""
        self._known[trial.path.name] = trial

    def read(self) -> tuple[list[StoredTrial], dict[Path, str]]:
        """Return all trials sorted by name, and an error message for each trial that cannot be used."""
        paths = self._paths()
        self._known = {
            path.name: trial for path in paths if (trial := self._unchanged(path, stamp_of(path))) is not None
        }
        unusable = {}
        try:
            unread = [path for path in paths if path.name not in self._known]
            results = read_runs(unread, self._workers)
            for number, (path, result) in enumerate(zip(unread, results, strict=True), start=1):
                if isinstance(result, str):
                    unusable[self._trials / path.name] = result
                else:
                    self.add(result)
                self._on_read(number, len(unread))
        finally:
            self._save()
        return [self._known[path.name] for path in paths if path.name in self._known], unusable

    def _paths(self) -> list[Path]:
        paths = run_paths(self._trials, self._label)
        return paths if self._names is None else [path for path in paths if path.name in self._names]

    def _unchanged(self, path: Path, stamp: Stamp) -> StoredTrial | None:
        trial = self._known.get(path.name)
        if trial is None or trial.stamp not in (stamp, UNSTAMPED):
            return None
        return replace(trial, stamp=stamp) if trial.stamp == UNSTAMPED else trial

    def _save(self) -> None:
        kept = {name: trial for name, trial in self._known.items() if trial.complete}
        if not self._trials.is_dir() or (kept == self._saved and self._file.is_file()):
            return
        with suppress(OSError), replacing(self._file) as path, gzip.open(path, "wb", compresslevel=1) as file:
            file.write(_header())
            file.writelines(_ENCODER.encode(trial) + b"\n" for trial in kept.values())
        self._saved = kept


def read_runs(paths: Sequence[Path], workers: int) -> Iterator[StoredTrial | str]:
    """Yield the trial in each run directory, or a message that explains why it cannot be read."""
    left = iter(paths)
    if workers > 1 and len(paths) >= POOL_FROM:
        with suppress(BrokenProcessPool), worker_pool(workers) as pool:
            for result in pool.map(_read, paths, chunksize=20):
                next(left)
                yield result
    for path in left:  # all trials, or those that the worker processes did not read
        yield _read(path)


def _rows_file(label: str) -> str:
    return ROWS.replace(".jsonl", f".{label}jsonl")


def _header() -> bytes:
    return f"{source_digest(*CODE)}\n".encode()


def _load(file: Path, trials: Path) -> Iterable[StoredTrial]:
    decoder = msgspec.json.Decoder(StoredTrial, dec_hook=lambda _, name: trials / name)
    if not file.is_file():
        return []
    try:
        with gzip.open(file, "rb") as lines:
            if lines.readline() == _header():
                return [decoder.decode(line) for line in lines]
    except (OSError, EOFError, zlib.error, msgspec.DecodeError, UnicodeDecodeError):
        pass
    return []


def _read(path: Path) -> StoredTrial | str:
    listed = path.parent.with_name(path.name) if path.parent.suffix == PACKED else path
    stamp = stamp_of(path)
    try:
        with opened_run(path) as run:
            return replace(read_trial(run), path=listed, stamp=stamp)
    except (RecordError, OSError, KeyError, TypeError, ValueError) as error:
        return str(error)
