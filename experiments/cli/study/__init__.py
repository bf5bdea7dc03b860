"""`mjsim study`: plan, run, simulate and analyse studies."""

import argparse
from typing import Any

from experiments.cli.doctor import add_checkout_command
from experiments.cli.options import HelpFormatter

# Modules of the subcommands, in the order in which `--help` lists them. The wheel does not contain `studies`.
MODULES = (
    "experiments.cli.study.prepare",
    "experiments.cli.study.check",
    "experiments.cli.study.rehearse",
    "experiments.cli.study.serve",
    "experiments.cli.study.researcher",
    "experiments.cli.study.pay",
    "experiments.cli.study.data",
    "experiments.cli.study.simulate",
    "studies.commands.controls",
    "experiments.cli.study.analyze",
    "studies.commands.score",
    "studies.commands.calibrate",
    "experiments.cli.study.power",
)

DESCRIPTION = """\
Plan, run, simulate and analyse studies, and compare them with the published study. All output from simulated
participants is marked as such: it is not evidence about people."""


def add_parser(commands: Any) -> None:
    parser: argparse.ArgumentParser = commands.add_parser(
        "study",
        help=None,  # completion scripts omit commands that have no `help` argument
        description=DESCRIPTION,
        formatter_class=HelpFormatter,
    )
    subcommands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for module in MODULES:
        add_checkout_command(subcommands, module.rpartition(".")[2], module)
