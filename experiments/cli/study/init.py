"""`mjsim study init`: a study file with all that a study with people needs, explained."""

import argparse
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command, add_force

DESCRIPTION = """\
Write a study file with comments: the cells of a design, who is left out, and the table [study] with what people see,
are asked and receive. Edit it, then run `mjsim study serve STUDY.toml --out DIR` to try it yourself."""


def add_parser(commands: Any) -> None:
    parser = add_command(
        commands, "init", run, summary="write a study file to start from", description=DESCRIPTION
    )
    parser.add_argument(
        "study", type=Path, nargs="?", default=Path("study.toml"), metavar="STUDY.toml", help="file to write"
    )
    add_force(parser, "replace a file that exists")


def run(arguments: argparse.Namespace) -> int:
    from experiments.record.run_directory import check_file
    from experiments.study.file import TEMPLATE
    from mjsim.support.files import read_text, write_text_atomically

    check_file(arguments.study, replace=arguments.force)
    write_text_atomically(arguments.study, read_text(TEMPLATE))
    print(f"{arguments.study} (try it: mjsim study serve {arguments.study} --out runs/my-study)")
    return 0
