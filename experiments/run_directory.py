"""The folder of a run: complete, or not there at all."""

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
    """Yield a working folder that is renamed to `path` on success.

    An earlier run at `path` is replaced; anything else there is never touched.

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
    """Move the working folder of a failed run to `<out>.failed`.

    An earlier failed run there is replaced; if something else has that name, a number is added.

    Returns:
        The new path.
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
