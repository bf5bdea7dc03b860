"""`mjsim study`: studies with simulated participants or people; their subcommands."""

import argparse
from typing import Any

from experiments.cli.options import HelpFormatter
from experiments.cli.requirements import add_checkout_command

# A module each, with `add_parser(commands)`; those outside the wheel need a checkout.
SUBCOMMANDS = {
    "init": "experiments.cli.study.init",
    "check": "experiments.cli.study.check_study",
    "serve": "experiments.cli.study.serve",
    "rehearse": "experiments.cli.study.rehearse",
    "collect": "experiments.cli.study.collect",
    "export": "experiments.cli.study.export",
    "pay": "experiments.cli.study.pay",
    "backup": "experiments.cli.study.backup",
    "restore": "experiments.cli.study.restore",
    "hosts": "experiments.cli.study.hosts",
    "researcher": "experiments.cli.study.researcher",
    "erase": "experiments.cli.study.erase",
    "forget": "experiments.cli.study.forget",
    "preregister": "experiments.cli.study.preregister",
    "simulate": "experiments.cli.study.simulate",
    "controls": "studies.commands.controls",
    "analyze": "experiments.cli.study.analyze",
    "score": "studies.commands.score",
    "calibrate": "studies.commands.calibrate",
    "power": "experiments.cli.study.power",
}

DESCRIPTION = """\
Studies: who took part, what was found, how it compares with the published study, how many people the next one needs.
All output from simulated participants is marked as such; it is no evidence about people."""


def add_parser(commands: Any) -> None:
    """Add the subcommand with its own subcommands."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "study",
        help=None,  # lets completion list it
        description=DESCRIPTION,
        formatter_class=HelpFormatter,
    )
    subcommands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, module in SUBCOMMANDS.items():
        add_checkout_command(subcommands, name, module)
