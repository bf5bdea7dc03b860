"""`mjsim view`: look at a recorded run in the browser."""

import argparse
import tempfile
import webbrowser
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command, add_force
from experiments.errors import ConfigError

DESCRIPTION = """\
Show a recorded run in the browser, drawn in three dimensions: a timeline with events and plans, the person's view with
its HUD, a view from above and a free camera, the planned and the walked path, at any speed. DIR is a run directory, of
`mjsim run`, a batch, a study or `mjsim play`; a session that is not over is shown as far as it goes. The run is
simulated again and verified first, as by `mjsim replay`.

The page is one HTML file without any other: --out keeps it, to be sent or attached to a paper. It needs a browser with
WebGL 2, and neither a server nor mjsim."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "view", run, description=DESCRIPTION)
    parser.add_argument("directory", type=Path, metavar="DIR", help="run directory or packed trial")
    parser.add_argument(
        "--out", type=Path, metavar="FILE.html", help="write the page to a file, and open nothing"
    )
    parser.add_argument(
        "--house",
        metavar="CATALOGUE",
        help="catalogue.toml of the run's house, where it does not lie where it was; its content must be the same",
    )
    add_force(parser, "replace a page that exists")


def run(arguments: argparse.Namespace) -> int:
    """Make the page, then keep or open it.

    Raises:
        ConfigError: The file has another ending.
        ReplayError: The run differs from its record.
    """
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn

    from experiments.cli.replay import run_of
    from experiments.cli.terminal import error_console, progress_bars
    from experiments.record.run_directory import check_file
    from experiments.study.data.copies import note_derived
    from experiments.web.viewing.page import view_page
    from mjsim.support.files import replacing

    if arguments.out is not None:
        if arguments.out.suffix != ".html":
            raise ConfigError(f"cannot write a page to {arguments.out}: name a file that ends in .html")
        check_file(arguments.out, replace=arguments.force)
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("steps"), TimeElapsedColumn())
    with run_of(arguments) as directory, progress_bars(error_console(), "replay", *columns) as bars:
        bar = bars.add_task("replay", total=None)
        page = view_page(
            directory,
            catalogue=arguments.house,
            on_progress=lambda done, total: bars.update(bar, completed=done, total=total),
        )
    path = arguments.out or Path(tempfile.mkdtemp(prefix="mjsim-view-")) / "run.html"
    note_derived(arguments.directory, "page", path)
    with replacing(path) as temporary:
        temporary.write_text(page, "utf-8")
    print(path)
    if arguments.out is None:
        webbrowser.open(path.as_uri())
    return 0
