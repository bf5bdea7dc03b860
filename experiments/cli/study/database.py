"""Arguments and helpers for commands that use a study file and its database."""

import argparse
import os
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from experiments.cli.doctor import require_extra
from experiments.errors import ConfigError, RecordError
from experiments.session.signals import run_until_signal
from experiments.trials.designs import study_path

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

    return read_people_study(study_path(arguments.study))


def checked_study(arguments: argparse.Namespace, *, recruits: bool = False) -> "Study":
    """Read a study file that something is to be started with. Unlike `people_study`, check all names in it.

    `recruits` requires the settings of the recruitment platform as well.
    """
    require_extra("people")
    from experiments.study.validation import check_study

    return check_study(study_path(arguments.study), recruits=recruits) or people_study(arguments)


def with_store(
    study: "Study",
    arguments: argparse.Namespace,
    work: "Callable[[Store], Awaitable[T]]",
    *,
    create: bool = False,
) -> T:
    """Open the database of a study, call `work` with it, and return the result.

    The database is closed even if a signal interrupts the work. `create` adds the study if there is none.
    """

    async def opened() -> T:
        store = await open_store(study, arguments, arguments.folder, create=create)
        try:
            return await work(store)
        finally:
            await store.close()

    return run_until_signal(opened())


async def open_store(
    study: "Study", arguments: argparse.Namespace, folder: Path, *, create: bool = False
) -> "Store":
    """Open the database of a study, which is in `folder` unless the arguments name another one.

    Raises:
        RecordError: The folder has no database, and `create` is false.
        StoreError: The database is of another program, another study or a newer version.
    """
    from experiments.visit.store import Store

    path, settings = folder / DATABASE, study.settings
    if url := getattr(arguments, "database", None):
        return await Store.open(str(url), settings.name, study.sha256, create=create)
    if not create and not path.is_file():
        raise RecordError(f"{folder} has no {DATABASE}; name the folder of `mjsim study serve`")
    return await Store.open(sqlite_url(path), settings.name, study.sha256, create=create, alone=True)


def add_database(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--database",
        metavar="URL",
        default=os.environ.get(URL),
        help="database of the study, such as postgresql://USER:PASSWORD@HOST/NAME or mysql://... (default: the value "
        f"of {URL}, which lists of processes do not show, else {DATABASE} in the study's folder)",
    )


def sqlite_url(path: Path) -> str:
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise ConfigError(f"{str(path)!r} cannot be the path of a database; it is not UTF-8") from None
    return f"sqlite:///{path.absolute()}"
