"""Check the output paths of commands, and create run directories atomically."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from experiments.errors import RecordError, listed
from experiments.record import records
from experiments.record.files import CHECKSUMS, write_checksums
from mjsim.support.files import exchange, work_folder

# Maximum number of folders that are inspected in a batch, because network file systems are slow
SAMPLE = 100
TRIALS = "trials"  # name of the subfolder of a batch that contains the runs
PACKED = ".sqlar"  # file suffix of an archive that contains runs
VISIT = "visit.json"  # name of the file that describes a visit to `mjsim play`
JOURNALS = "journals"  # name of the subfolder of a visit that contains the journals


def is_run(directory: Path) -> bool:
    return (directory / records.EPISODE).is_file() and (directory / records.EVENTS).is_file()


def is_batch(directory: Path) -> bool:
    """Return True if `directory` is a batch folder. Only a sample of its runs is inspected."""
    trials = directory / TRIALS
    if not trials.is_dir():
        return False
    with os.scandir(trials) as entries:
        inside = [entry for entry in entries if PACKED in entry.name or not entry.name.startswith(".")]
    if not inside:  # a batch that was killed during its first trials has no tables
        return not list(directory.glob(f"{TRIALS}.*"))
    folders = [entry for entry in inside if PACKED not in entry.name]
    sample = (Path(entry) for entry in folders[:SAMPLE])
    return all(entry.is_dir() for entry in folders) and all(is_run(p) or not p.exists() for p in sample)


def visit_folders(directory: Path) -> list[Path]:
    """Return the folders of all visits in one or several output folders of `mjsim play`, sorted by name."""
    found = (path for depth in ("*", "*/*") for path in directory.glob(f"{depth}/{VISIT}"))
    return sorted(path.parent for path in found)


def check_run_directory(path: Path, *, replace: bool = False) -> Path:
    """Check that a run may be written to a path. Return the path with symbolic links resolved.

    Args:
        path: The path.
        replace: True if an earlier run may be replaced.

    Raises:
        RecordError: The path contains other files. The message explains what to do.
        OSError: The path cannot be used because it is too long, below a file, or not readable.
    """
    place = _place(path)
    if not place.exists():
        return place
    if not place.is_dir():
        raise RecordError(f"{path} is a file; name a folder that does not exist yet")
    if Path.cwd().is_relative_to(place) or place.is_mount():
        raise RecordError(f"{path} is in use as a folder; name a new one inside it, such as {path / 'run'}")
    names = sorted(entry.name for entry in place.iterdir())
    if not names:
        return place
    ours = {*records.FILES, CHECKSUMS, *([records.TRAINING] if is_run(place / records.TRAINING) else [])}
    foreign = [name for name in names if name not in ours]
    if is_batch(place):
        raise RecordError(f"{path} holds a batch, which a run never replaces; choose another --out")
    if foreign or not is_run(place):
        raise RecordError(
            f"{path} holds {listed(foreign or names)}, which no run wrote; choose another --out or move it away "
            "(--force replaces only a run)"
        )
    if not replace:
        raise RecordError(f"{path} holds a run; choose another --out, or replace that run with --force")
    return place


def check_batch_folder(path: Path) -> None:
    """Check that a batch may be written to a folder, which may already contain an earlier batch.

    Raises:
        RecordError: The folder contains other files.
        OSError: The folder cannot be written.
    """
    place = _place(path)
    if place.exists() and not place.is_dir():
        raise RecordError(f"{path} is a file; name a folder for --out")
    if place.exists() and any(place.iterdir()) and not is_batch(place):
        what = "a run" if is_run(place) else listed(sorted(entry.name for entry in place.iterdir()))
        raise RecordError(
            f"{path} holds {what} and is not the folder of a batch; choose another --out or move it away"
        )
    _check_writable(_existing(place / TRIALS))


def check_file(path: Path | None, *, replace: bool = False) -> None:
    """Check that a file may be written to `path`. None, for an option that was not given, is accepted.

    Raises:
        RecordError: `path` exists and cannot be replaced.
        OSError: The folder of the file cannot be written.
    """
    if path is None:
        return
    place = _place(path)
    if place.exists() and not place.is_file():
        raise RecordError(f"{path} is not a regular file; name a file that does not exist yet")
    if place.exists() and not replace:
        raise RecordError(f"{path} exists; name another file, or replace it with --force")
    _check_writable(_existing(place.parent))


@contextmanager
def run_directory(path: Path, *, replace: bool = False, scratch: Path | None = None) -> Iterator[Path]:
    """Yield a temporary folder that becomes the run directory at the end of the block, even after an error.

    The folder is deleted instead if it contains no metrics.

    Args:
        path: Path of the run directory.
        replace: True if an earlier run may be replaced.
        scratch: Parent of the temporary folder (default: the parent of `path`).

    Raises:
        RecordError: `path` exists and cannot be replaced. If it appeared during the run, the run is saved next to it.
        OSError: The folder cannot be written.
    """
    place = check_run_directory(path, replace=replace)
    with _folder(place.parent), work_folder(scratch or place.parent) as folder:
        try:
            yield folder
        finally:
            if (folder / records.METRICS).is_file():
                folder.chmod(0o755)
                _move(folder, place, replace=replace)


def add_files(folder: Path, path: Path) -> None:
    """Atomically add the files of a temporary folder to a run directory, and update its checksums.

    Afterwards, the temporary folder contains the previous version of the run directory.
    """
    place = Path(os.path.realpath(path))
    shutil.copytree(place, folder, copy_function=link_or_copy, dirs_exist_ok=True)
    write_checksums(folder, records.FILES)
    exchange(folder, place)


def free_name(path: Path) -> Path:
    """Return `path`, or if it exists, `path` followed by the first free number."""
    number, free = 1, path
    while os.path.lexists(free):
        number += 1
        free = path.with_name(f"{path.name}-{number}")
    return free


def _move(folder: Path, place: Path, *, replace: bool) -> None:
    try:
        check_run_directory(place, replace=replace)
        if place.exists() and any(place.iterdir()):
            exchange(folder, place)
        else:
            folder.replace(place)
    except (OSError, RecordError) as error:
        kept = free_name(place)
        folder.replace(kept)
        raise RecordError(f"{error}; the run is kept in {kept}") from error


def link_or_copy(source: str, target: str) -> None:
    """Hard-link a file, or copy it if the file system does not support links."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)


@contextmanager
def _folder(folder: Path) -> Iterator[None]:
    """Create a folder and its parents, and remove those that are still empty at the end of the block."""
    made = [parent for parent in (folder, *folder.parents) if not parent.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    try:
        _check_writable(folder)
        yield
    finally:
        for parent in made:
            with suppress(OSError):
                parent.rmdir()


def _place(path: Path) -> Path:
    if path.is_symlink() and not path.exists():
        raise RecordError(f"{path} is a dangling symbolic link; remove it or choose another --out")
    place = Path(os.path.realpath(path))
    with suppress(FileNotFoundError, NotADirectoryError):
        place.stat()  # since Python 3.14, `exists` returns False for names that are too long
    return place


def _existing(folder: Path) -> Path:
    while not folder.exists():
        folder = folder.parent
    return folder


def _check_writable(folder: Path) -> None:
    try:
        with tempfile.TemporaryFile(dir=folder):  # an unnamed file is never left behind
            pass
    except OSError as error:
        raise OSError(error.errno, f"cannot be written to ({error.strerror})", str(folder)) from error
