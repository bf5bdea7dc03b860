"""`mjsim view`: show a recorded run in a web browser."""

import argparse
import tempfile
import webbrowser
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command, add_force
from experiments.errors import ConfigError

DESCRIPTION = """\
Show a recorded run in 3D in the browser: a timeline with events and plans, the participant's view with its HUD, a view
from above, a free camera, and the planned and walked paths, at any speed. DIR is a run directory of `mjsim run`, a
batch, a study or `mjsim play`. An unfinished session is shown as far as it was recorded. The run is first simulated
again and verified, as by `mjsim replay`.

The page is a single HTML file, which --out saves, for example to attach it to a paper. It needs a browser with WebGL 2,
but no server and no mjsim."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "view", run, DESCRIPTION)
    parser.add_argument("directory", type=Path, metavar="DIR", help="run directory or packed trial")
    parser.add_argument(
        "--out", type=Path, metavar="FILE.html", help="write the page to a file instead of opening it"
    )
    parser.add_argument(
        "--house",
        metavar="CATALOGUE",
        help="catalogue.toml of the run's house, if it was moved; its content must be the same",
    )
    add_force(parser, "replace an existing page")


def run(arguments: argparse.Namespace) -> int:
    from experiments.cli.replay import run_of
    from experiments.cli.terminal import counting_bars
    from experiments.record.run_directory import check_file
    from experiments.study.data.copies import note_derived
    from experiments.web.viewing.page import view_page
    from mjsim.support.files import replacing

    if arguments.out is not None:
        if arguments.out.suffix != ".html":
            raise ConfigError(f"cannot write a page to {arguments.out}: name a file that ends in .html")
        check_file(arguments.out, replace=arguments.force)
    with run_of(arguments) as directory, counting_bars("steps") as bars:
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
