"""`mjsim study export`: all data of a study with people, to be kept or published."""

import argparse
import sys
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command, add_force
from experiments.cli.study.database import add_database, add_served_study, people_study, with_store

DESCRIPTION = """\
Write all data of a study to a new folder that follows Psych-DS: tidy tables (data/), the run directories of trials
(runs/PERSON/PHASE), the meaning of each column (documentation/codebook.csv, dataset_description.json). People are
numbers. Ids of platforms, links, their hashes and addresses are not in it, nor anybody who did not agree or wanted the
data deleted. The folder is there whole or not at all.

What people wrote freely is in a table of its own: read it before you publish it."""


def add_parser(commands: Any) -> None:
    parser = add_command(
        commands, "export", run, summary="all data of a study with people", description=DESCRIPTION
    )
    add_served_study(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="EXPORT", help="folder to make")
    add_database(parser)
    add_force(parser, "replace an earlier export")


def run(arguments: argparse.Namespace) -> int:
    """Export; 1 if a run cannot be used."""
    study = people_study(arguments)
    from experiments.study.data.export import check_export, export

    folder, out, force = arguments.folder, arguments.out, arguments.force
    check_export(out, replace=force)
    found = with_store(study, arguments, lambda store: export(study, store, folder, out, replace=force))
    for person, fault in found.collected.unusable.items():
        print(f"mjsim: {person}: {fault}", file=sys.stderr)
    print(f"{arguments.out} ({found.people} people, {found.runs} runs)")
    return 1 if found.collected.unusable else 0
