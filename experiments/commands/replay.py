"""`mjsim replay`: simulate a recorded run again, verify it, film it in another view."""

import argparse
import sys
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from experiments.commands.options import add_frame, assistance_help
from experiments.errors import ConfigError, ReplayError
from experiments.first_person import FilmConfig
from experiments.replaying.overview import CAMERAS, FIRST_PERSON
from experiments.replaying.replay import ReplayFilm, ReplayReport, replay

DESCRIPTION = """\
Simulate a recorded run again and verify, at every control step, that the state of the physics is the recorded one to
the last bit. DIR is a run directory, or what a run left whose physics failed (OUT.failed). Prints the number of steps
verified and exits with 0, or names the first bad step and exits with 1.

With --video, the replay is filmed: as it was, or in another size, from another camera, with another HUD."""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "replay",
        help="replay and verify a recorded run; film it in another view",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("directory", type=Path, metavar="DIR", help="run directory")
    parser.add_argument(
        "--from",
        dest="start",
        type=float,
        default=0.0,
        metavar="T",
        help="start at the last checkpoint at or before T seconds (0)",
    )
    parser.add_argument("--video", type=Path, metavar="FILE.mp4", help="film the replay")
    parser.add_argument(
        "--camera", choices=CAMERAS, default=FIRST_PERSON, help=f"where to look from ({FIRST_PERSON})"
    )
    parser.add_argument(
        "--eye", type=point, metavar="X,Y,Z", help="where a free camera stands, m (it circles the house)"
    )
    parser.add_argument(
        "--target",
        type=point,
        metavar="X,Y,Z",
        help="what a free camera looks at, m (the middle of the floor)",
    )
    parser.add_argument(
        "--assistance", metavar="NAME", help=f"show the glasses of another {assistance_help()} (as recorded)"
    )
    add_frame(parser)
    parser.set_defaults(run=run)


def point(text: str) -> tuple[float, float, float]:
    """Parse `1.5,2,8`.

    Raises:
        argparse.ArgumentTypeError: It is not three numbers.
    """
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form X,Y,Z, such as 1.5,2,8") from None
    return x, y, z


def run(arguments: argparse.Namespace) -> int:
    """Replay with a progress bar; 1 if something is not as recorded."""
    film = None
    if arguments.video is not None:
        width, height = arguments.size
        film = ReplayFilm(
            path=arguments.video,
            config=FilmConfig(width, height, arguments.profile),
            camera=arguments.camera,
            eye=arguments.eye,
            target=arguments.target,
        )
    elif arguments.camera != FIRST_PERSON or arguments.eye or arguments.target:
        raise ConfigError("a camera needs a film; name the file with --video FILE.mp4")
    console = Console(stderr=True)
    columns = (
        TextColumn("replay"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("steps"),
        TimeElapsedColumn(),
    )
    try:
        with Progress(*columns, console=console) as bars:
            bar = bars.add_task("replay", total=None)
            report = replay(
                arguments.directory,
                start=arguments.start,
                film=film,
                assistance=arguments.assistance,
                on_progress=lambda done, total: bars.update(bar, completed=done, total=total),
            )
    except ReplayError as error:
        print(f"mjsim: {error}", file=sys.stderr)
        return 1
    print(_summary(report))
    if arguments.video is not None:
        as_run = "; its frames are those of the run's own video" if report.as_filmed else ""
        print(f"{arguments.video}{as_run}")
    return 0


def _summary(report: ReplayReport) -> str:
    text = f"{report.steps} steps verified"
    if report.first:
        text += f" from the checkpoint at step {report.first} on"
    text += f"; the run ended with {report.ended!r}"
    if report.failure:
        text += f", and so does the replay: {report.failure}"
    for difference in report.differences:
        text += f"\nwithout consequence: {difference}"
    return text
