"""`mjsim study`: studies with simulated participants or people; one subcommand per module of this folder."""

import argparse
import importlib
from typing import Any

from experiments.commands.options import HelpFormatter

# A module each, with `add_parser(commands)`.
SUBCOMMANDS = ("simulate", "controls", "analyze", "score", "calibrate", "power")

DESCRIPTION = """\
Studies: who took part, what was found, how it compares with the published study, how many people the next one needs.
What comes of simulated participants says so on every output; it measures nobody."""


def add_parser(commands: Any) -> None:
    """Add the subcommand with its own subcommands."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "study",
        help="simulate and analyse studies, score them against the published one, plan them",
        description=DESCRIPTION,
        formatter_class=HelpFormatter,
    )
    subcommands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name in SUBCOMMANDS:
        importlib.import_module(f"{__name__}.{name}").add_parser(subcommands)
