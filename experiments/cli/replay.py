"""`mjsim replay`: replay and verify a recorded run, or record a video of it from another camera."""

import argparse
import math
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cli.options import (
    NAMES,
    add_command,
    add_force,
    add_frame,
    add_language,
    film_config,
    seconds,
)
from experiments.errors import ConfigError, ReplayError
from experiments.session.film_config import CAMERAS, FIRST_PERSON

if TYPE_CHECKING:
    from experiments.trials.replay.replay import ReplayReport

DESCRIPTION = """\
Simulate a recorded run again and verify at every control step that the state of the physics equals the recorded one bit
for bit. DIR is a run directory or a packed trial (OUT/trials/NAME), even of a run that ended early. The result of the
verification is printed for each file. The exit code is 0, or 1 if a step differs; the first such step is named. An
unfinished session of `mjsim play` is replayed from its journal.

With --video, film the replay: as recorded, or in another size, from another camera, or with another HUD."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "replay", run, DESCRIPTION)
    parser.add_argument("directory", type=Path, metavar="DIR", help="run directory or packed trial")
    parser.add_argument(
        "--from",
        dest="start",
        type=seconds,
        default=0.0,
        metavar="T",
        help="start at the last checkpoint at or before T simulated seconds",
    )
    parser.add_argument(
        "--house",
        metavar="CATALOGUE",
        help="catalogue.toml of the run's house, if it was moved; its content must be the same",
    )
    parser.add_argument("--video", type=Path, metavar="FILE.mp4", help="film the replay")
    parser.add_argument("--camera", choices=CAMERAS, default=FIRST_PERSON, help="camera of the film")
    parser.add_argument(
        "--eye",
        type=point,
        metavar="X,Y,Z",
        help="position of a free camera, in metres (default: circles the house)",
    )
    parser.add_argument(
        "--target",
        type=point,
        metavar="X,Y,Z",
        help="target of a free camera, in metres (default: the middle of the floor)",
    )
    parser.add_argument(
        "--assistance",
        metavar="NAME",
        help=f"show the HUD of another assistance condition{NAMES['assistance']()} (default: as recorded)",
    )
    add_frame(
        parser,
        size=None,
        otherwise=" (default: 960x540, or the shape of the page if a browser drew the session)",
    )
    add_language(parser)
    add_force(parser, "replace an existing video")


def point(text: str) -> tuple[float, float, float]:
    """Parse the coordinates of a point, such as `1.5,2,8`."""
    try:
        x, y, z = (float(part) for part in text.split(","))
        if not all(map(math.isfinite, (x, y, z))):
            raise ValueError
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form X,Y,Z, such as 1.5,2,8") from None
    return x, y, z


def run(arguments: argparse.Namespace) -> int:
    from experiments.cli.terminal import counting_bars
    from experiments.record.run_directory import check_file
    from experiments.study.data.copies import note_derived
    from experiments.trials.replay.replay import ReplayFilm, replay

    film = None
    if arguments.video is not None:
        if arguments.video.suffix != ".mp4":
            raise ConfigError(f"cannot film to {arguments.video}: name a file that ends in .mp4")
        check_file(arguments.video, replace=arguments.force)
        note_derived(arguments.directory, "film", arguments.video)
        film = ReplayFilm(
            path=arguments.video,
            config=film_config(arguments, panels=arguments.camera == FIRST_PERSON)
            if arguments.size
            else None,
            profile=arguments.profile,
            camera=arguments.camera,
            eye=arguments.eye,
            target=arguments.target,
        )
    elif arguments.camera != FIRST_PERSON or arguments.eye or arguments.target:
        raise ConfigError("a camera needs a film; name the file with --video FILE.mp4")
    try:
        with run_of(arguments) as directory, counting_bars("steps") as bars:
            bar = bars.add_task("replay", total=None)
            report = replay(
                directory,
                start=arguments.start,
                film=film,
                assistance=arguments.assistance,
                catalogue=arguments.house,
                language=arguments.language,
                on_progress=lambda done, total: bars.update(bar, completed=done, total=total),
            )
    except ReplayError as error:
        for line in error.verdicts:
            print(line)
        raise
    print(_summary(report))
    if arguments.video is not None:
        as_run = "; its frames are those of the run's own video" if report.as_filmed else ""
        print(f"{arguments.video}{as_run}")
    return 0


@contextmanager
def run_of(arguments: argparse.Namespace) -> Iterator[Path]:
    """Yield the run directory to use. Create a temporary one for a packed trial or an unfinished session."""
    from experiments.house import House
    from experiments.record.archive import opened_run
    from experiments.record.run_directory import is_run
    from experiments.web.worker.live_session import journal_of, save_run

    journal = None if is_run(arguments.directory) else journal_of(arguments.directory)
    if journal is None:
        with opened_run(arguments.directory) as run:
            yield run
        return
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "unfinished"
        save_run(journal, run, None if arguments.house is None else House.load(arguments.house))
        yield run


def _summary(report: "ReplayReport") -> str:
    text = "\n".join(map(str, report.verdicts)) + f"\n{report.steps} steps verified"
    if report.first:
        text += f" from the checkpoint at step {report.first}"
    text += f"; the run ended with {report.ended!r}"
    if report.failure:
        text += f", and so does the replay: {report.failure}"
    if unusual := report.person.unusual():
        text += f"\nthe participant: {unusual}"
    for difference in report.differences:
        text += f"\nwithout effect: {difference}"
    return text
