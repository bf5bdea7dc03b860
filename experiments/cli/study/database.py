"""Arguments and helpers for commands that use a study file and its database."""

import argparse
import os
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from experiments.cli.doctor import require_extra
from experiments.errors import ConfigError, RecordError
from experiments.session.signals import run_until_signal

if TYPE_CHECKING:
    from experiments.study.file import Study
    from experiments.visit.store import Store

T = TypeVar("T")
DATABASE = "study.db"
URL = "MJSIM_STUDY_DATABASE"  # environment variable with the URL of the database


def add_study_file(parser: argparse.ArgumentParser, **settings: Any) -> None:
    parser.add_argument(
        "study", metavar="STUDY.toml", help="study file, or `paper` for the published study", **settings
    )


def add_served_study(parser: argparse.ArgumentParser) -> None:
    add_study_file(parser)
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of the study")


def people_study(arguments: argparse.Namespace) -> "Study":
    require_extra("people")
    from experiments.study.file import read_people_study
    from experiments.trials.designs import study_path

    return read_people_study(study_path(arguments.study))


def with_store(
    study: "Study",
    arguments: argparse.Namespace,
    work: "Callable[[Store], Awaitable[T]]",
    url: str | None = None,
) -> T:
    """Open the database of a study, call `work` with it, and return the result.

    The database is closed even if a signal interrupts the work.
    """
    from experiments.visit.store import Store

    async def opened() -> T:
        store = await Store.open(url or database_url(arguments), study.settings.name, study.sha256)
        try:
            return await work(store)
        finally:
            await store.close()

    return run_until_signal(opened())


def add_database(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--database",
        metavar="URL",
        default=os.environ.get(URL),
        help="database of the study, such as postgresql://USER:PASSWORD@HOST/NAME or mysql://... (default: the value "
        f"of {URL}, which lists of processes do not show, else {DATABASE} in the study's folder)",
    )


def database_url(arguments: argparse.Namespace) -> str:
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
