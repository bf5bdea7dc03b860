"""The study file and the database of a study with people, as commands name them."""

import argparse
import os
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from experiments.cli.requirements import require_extra
from experiments.errors import ConfigError, RecordError
from experiments.session.signals import run_until_signal

if TYPE_CHECKING:
    from experiments.study.file import Study
    from experiments.visit.store import Store

T = TypeVar("T")
DATABASE = "study.db"
URL = "MJSIM_STUDY_DATABASE"  # environment variable


def add_served_study(parser: argparse.ArgumentParser) -> None:
    """Add the study file and the folder of a study that has been served."""
    parser.add_argument("study", metavar="STUDY.toml", help="study file, or `paper`")
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of the study")


def people_study(arguments: argparse.Namespace) -> "Study":
    """Read the study file of a command; a ConfigError if the extra `people` is missing or the file is unusable."""
    require_extra("people")
    from experiments.study.file import read_people_study
    from experiments.trials.simulate import study_path

    return read_people_study(study_path(arguments.study))


def with_store(
    study: "Study",
    arguments: argparse.Namespace,
    work: "Callable[[Store], Awaitable[T]]",
    url: str | None = None,
) -> T:
    """Open the database of a study, do `work` with it, and close it, also after a signal. Return the result."""
    from experiments.visit.store import Store

    async def opened() -> T:
        store = await Store.open(url or database_url(arguments), study.settings.name, study.sha256)
        try:
            return await work(store)
        finally:
            await store.close()

    return run_until_signal(opened())


def add_database(parser: argparse.ArgumentParser) -> None:
    """Add `--database`."""
    parser.add_argument(
        "--database",
        metavar="URL",
        default=os.environ.get(URL),
        help="database of people and answers, such as postgresql://USER:PASSWORD@HOST/NAME or mysql://... (default: "
        f"what {URL} says, which no list of processes shows, else {DATABASE} in the study's folder)",
    )


def database_url(arguments: argparse.Namespace) -> str:
    """The URL of the database of a study that has been served."""
    if arguments.database:
        return str(arguments.database)
    path: Path = arguments.folder / DATABASE
    if not path.is_file():
        raise RecordError(f"{arguments.folder} has no {DATABASE}; name the folder of `mjsim study serve`")
    return sqlite_url(path)


def sqlite_url(path: Path) -> str:
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise ConfigError(f"{str(path)!r} cannot be the path of a database; it is not UTF-8") from None
    return f"sqlite:///{path.absolute()}"
