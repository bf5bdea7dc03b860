"""The command `mjsim gallery`, which makes the pictures of the documentation."""

import argparse
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command, add_force, add_frame, film_config

DESCRIPTION = """\
Take a picture of each assistance condition from real trials, as OUT/<name>.png, draw the floor plan of a trial, as
OUT/topdown.png, and make a contact sheet of the three conditions in four situations, as OUT/contact_sheet.png.

`mjsim gallery levels` draws the figure of the paper's four levels of difficulty instead, as OUT/levels.png: one house
from above with 6, 12, 18 and 24 objects, and the shortest way to tidy it in the first."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "gallery", run, DESCRIPTION)
    parser.add_argument(
        "what", nargs="?", choices=("pictures", "levels"), default="pictures", help="what to draw"
    )
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="seed of the house of the levels")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the pictures")
    add_frame(parser, size=(1280, 720), profile="quality")
    add_force(parser)
    parser.add_argument(
        "--contact-sheet",
        action="store_true",
        help="make only the contact sheet, from frames of 960x540 in profile fast, as in a run",
    )
    parser.add_argument(
        "--frames", action="store_true", help="also write the frames of the contact sheet, in full size"
    )


def run(arguments: argparse.Namespace) -> int:
    from experiments.cli.terminal import error_console
    from tools.gallery import make_gallery
    from tools.levels import make_levels

    if arguments.what == "levels":
        path = make_levels(arguments.out, arguments.seed, replace=arguments.force)
        error_console().print(str(path), soft_wrap=True)
        return 0
    for path in make_gallery(
        arguments.out,
        film_config(arguments),
        replace=arguments.force,
        sheet_only=arguments.contact_sheet,
        frames=arguments.frames,
    ):
        error_console().print(str(path), soft_wrap=True)
    return 0
