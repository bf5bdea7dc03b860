"""`mjsim gallery`: the pictures of the documentation."""

import argparse
import shutil
import tempfile
from pathlib import Path
from typing import Any

from experiments.commands.options import add_command, add_force, add_frame, film_config
from experiments.commands.terminal import error_console
from experiments.gallery import SITUATIONS, Shot, after, carrying_two, contact_sheet, save_png, take_pictures
from experiments.runs.records import TOPDOWN
from experiments.runs.run_directory import check_file
from experiments.session.film_config import FilmConfig
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from mjsim.errors import RenderError
from mjsim.files import replacing

SEED = 7
CONDITIONS = ("none", "highlight", "optimal")
SHOTS = (
    Shot("guided", TrialConfig(objects=12, assistance="guided", seed=SEED), after(0.4)),
    Shot("optimal_carrying", TrialConfig(objects=12, assistance="optimal", seed=SEED), carrying_two),
    Shot("highlight", TrialConfig(objects=12, assistance="highlight", seed=SEED), after(1.3)),
    Shot("none", TrialConfig(objects=12, assistance="none", seed=0), after(6.0)),
)
SHEET = "contact_sheet.png"
WALK = TrialConfig(objects=6, assistance="optimal", seed=0, fidelity="event")  # of the floor plan

DESCRIPTION = """\
Take a picture of each assistance condition from real trials, as OUT/<name>.png, draw the floor plan of a trial, as
OUT/topdown.png, and make a contact sheet of the three conditions in four situations, as OUT/contact_sheet.png."""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser = add_command(
        commands, "gallery", run, summary="make the pictures of the documentation", description=DESCRIPTION
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the pictures")
    add_frame(parser, size=(960, 720), profile="quality")
    add_force(parser)
    parser.add_argument(
        "--contact-sheet",
        action="store_true",
        help="make only the contact sheet, from frames of 640x480 in profile fast, as in a run",
    )
    parser.add_argument(
        "--frames", action="store_true", help="also write the frames of the contact sheet, in full size"
    )


def _names(arguments: argparse.Namespace) -> list[str]:
    """Files that will be written."""
    names = [] if arguments.contact_sheet else [TOPDOWN, *(f"{shot.name}.png" for shot in SHOTS)]
    if arguments.frames:
        names += [f"{condition}_{key}.png" for condition in CONDITIONS for key in SITUATIONS]
    return [*names, SHEET]


def _fail(warning: str) -> None:
    """A picture that a trial does without is all that a gallery wants of it."""
    raise RenderError(warning)


def run(arguments: argparse.Namespace) -> int:
    """Take the pictures."""
    console = error_console()
    for name in _names(arguments):
        check_file(arguments.out / name, replace=arguments.force)
    arguments.out.mkdir(parents=True, exist_ok=True)

    def write(name: str, frame: Any) -> None:
        save_png(arguments.out / name, frame)
        console.print(str(arguments.out / name), soft_wrap=True)

    if not arguments.contact_sheet:
        with tempfile.TemporaryDirectory() as folder, replacing(arguments.out / TOPDOWN) as drawn:
            run_trial(WALK, Path(folder) / "run", on_warning=_fail)
            shutil.copyfile(Path(folder) / "run" / TOPDOWN, drawn)
        console.print(str(arguments.out / TOPDOWN), soft_wrap=True)
        for name, frame in take_pictures(SHOTS, film_config(arguments)).items():
            write(f"{name}.png", frame)
    frames = {}
    for condition in CONDITIONS:
        trial = TrialConfig(objects=12, assistance=condition, seed=SEED)
        shots = [Shot(key, trial, moment) for key, (_, moment) in SITUATIONS.items()]
        for key, frame in take_pictures(shots, FilmConfig()).items():
            frames[condition, key] = frame
            if arguments.frames:
                write(f"{condition}_{key}.png", frame)
    write(SHEET, contact_sheet(CONDITIONS, frames))
    return 0
