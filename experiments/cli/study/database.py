"""The database of a study, as commands name it."""

import argparse
import os
from pathlib import Path

from experiments.errors import ConfigError, RecordError

DATABASE = "study.db"
URL = "MJSIM_STUDY_DATABASE"  # environment variable


def add_served_study(parser: argparse.ArgumentParser) -> None:
    """Add the study file and the folder of a study that has been served."""
    parser.add_argument("study", metavar="STUDY.toml", help="study file, or `paper`")
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of the study")


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
    """The URL of an SQLite file."""
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise ConfigError(f"{str(path)!r} cannot be the path of a database; it is not UTF-8") from None
    return f"sqlite:///{path.absolute()}"
