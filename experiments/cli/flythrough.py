"""`mjsim flythrough`: record a video of the rooms and bins of a house."""

import argparse
from pathlib import Path
from typing import Any

from experiments.cli.options import (
    add_command,
    add_force,
    add_frame,
    add_language,
    add_setting,
    film_config,
    seconds,
)
from experiments.errors import ConfigError
from experiments.session.film_config import FilmConfig

DESCRIPTION = """\
Film a tidy house as participants see it before the task: a camera at eye height moves through all rooms, looks around
in each, and pauses at each bin. Captions name the room and the bin. Equal options give equal frames."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "flythrough", run, DESCRIPTION)
    add_setting(parser, "house", default="apartment")
    parser.add_argument("--out", type=Path, required=True, metavar="FILM.mp4", help="film to write")
    parser.add_argument(
        "--seconds",
        type=seconds,
        metavar="S",
        help="length of the film, at least 1 s (default: as long as it takes at walking speed)",
    )
    add_force(parser)
    add_frame(parser, size=(640, 480))
    add_language(parser)


def run(arguments: argparse.Namespace) -> int:
    from experiments.record.run_directory import check_file
    from mjsim.generator.home_cache import load_catalogue
    from mjsim.house.catalogue.files import read_labels
    from mjsim.house.catalogue.house_ref import models_root

    if arguments.out.suffix != ".mp4":
        raise ConfigError(f"cannot film to {arguments.out}: name a file that ends in .mp4")
    check_file(arguments.out, replace=arguments.force)
    language, folder = arguments.language, load_catalogue(arguments.house).folder
    if language != "en" and not read_labels(language, (models_root(), folder)):
        raise ConfigError(f"no labels in language {language!r}; write labels.{language}.toml in {folder}")
    frames = film_house(
        arguments.house,
        arguments.out,
        film_config(arguments, panels=False),
        arguments.seconds,
        language,
    )
    print(f"{arguments.out} (frames {frames})")
    return 0


def film_house(
    name: str,
    path: Path,
    film: FilmConfig | None = None,
    seconds: float | None = None,
    language: str = "en",
) -> str:
    """Record a video of a house and show a progress bar. Return the SHA-256 of the frames."""
    from experiments.cli.terminal import counting_bars
    from experiments.house import House
    from experiments.session.film import write_flythrough

    with counting_bars("{task.description}") as bars:
        bar = bars.add_task("loading the house", total=None)
        house = House.load(name)
        bars.update(bar, description="frames of the film")
        return write_flythrough(
            house.in_language(language, house.texts),  # captions contain no HUD texts
            path,
            film or FilmConfig(),
            seconds=seconds,
            on_progress=lambda done, total: bars.update(bar, completed=done, total=total),
        )
