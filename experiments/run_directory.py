"""The folder of a run: it appears whole or not at all."""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from experiments.errors import RecordError
from experiments.records import EPISODE, EVENTS


def is_run(directory: Path) -> bool:
    """Whether `directory` holds the record of a trial."""
    return (directory / EPISODE).is_file() and (directory / EVENTS).is_file()


@contextmanager
def run_directory(path: Path) -> Iterator[Path]:
    """Yield a working folder that becomes `path` on success, in one rename.

    An earlier run at `path` is replaced; anything else there is left alone.

    Raises:
        RecordError: `path` exists and is not a run, so replacing it could destroy something.
    """
    if path.exists() and not is_run(path) and (not path.is_dir() or any(path.iterdir())):
        raise RecordError(f"{path} exists and is not a run; choose another --out or move it away")
    path.parent.mkdir(parents=True, exist_ok=True)
    working = Path(tempfile.mkdtemp(dir=path.parent, prefix=f".{path.name}-"))
    try:
        yield working
        working.chmod(0o755)
        if path.exists():
            shutil.rmtree(path)
        working.replace(path)
    finally:
        if working.exists():
            shutil.rmtree(working)


def keep_failed(folder: Path, out: Path) -> Path:
    """Keep the working folder of a run that failed, beside where the run was to be, as `<out>.failed`.

    An earlier one is replaced; anything else of that name is left alone, and the folder gets a number.

    Returns:
        Where it is now.
    """
    kept, number = out.with_name(f"{out.name}.failed"), 1
    while kept.exists() and not is_run(kept):
        number += 1
        kept = out.with_name(f"{out.name}.failed-{number}")
    if kept.exists():
        shutil.rmtree(kept)
    folder.chmod(0o755)
    folder.replace(kept)
    return kept
