"""`mjsim gallery`: the pictures of the README."""

import argparse
from pathlib import Path
from typing import Any

from rich.console import Console

from experiments.commands.options import frame_size
from experiments.gallery import Shot, take_pictures
from experiments.glasses import FilmConfig
from experiments.trial import TrialConfig
from mjsim.render import PROFILES

SHOTS = (
    Shot("optimal", TrialConfig(objects=12, assistance="optimal", seed=0), 2.0),
    Shot("highlight", TrialConfig(objects=12, assistance="highlight", seed=0), 3.0),
    Shot("none", TrialConfig(objects=12, assistance="none", seed=0), 6.0),
)


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "gallery",
        help="make the pictures of the README",
        description="Take a picture of each assistance condition from real trials, as OUT/<condition>.png.",
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the pictures")
    parser.add_argument(
        "--size", type=frame_size, default=(960, 720), metavar="WxH", help="frame size (960x720)"
    )
    parser.add_argument(
        "--profile",
        default="quality",
        metavar="NAME",
        help=f"render profile: {', '.join(PROFILES)} (quality)",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Take the pictures."""
    console = Console(stderr=True, highlight=False)
    film = FilmConfig(arguments.size[0], arguments.size[1], arguments.profile)
    take_pictures(
        SHOTS,
        arguments.out,
        film,
        lambda shot: console.print(f"{arguments.out / shot.name}.png", soft_wrap=True),
    )
    return 0
