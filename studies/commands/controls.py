"""The command `mjsim study controls`, which simulates the negative controls of a study."""

import argparse
from pathlib import Path
from typing import Any

from experiments.cli.batch_progress import run_with_progress
from experiments.cli.options import add_command
from experiments.cli.study.simulate import add_study

DESCRIPTION = """\
Simulate the negative controls of a study (studies/controls.toml). In each control, the same people use another
participant model, or their model lacks one part. Each control is a study with its own folder under DIR. If a control
still agrees with a published result, that result is not evidence for the missing part."""


def add_parser(commands: Any) -> None:
    """Add the subcommand `controls` to `mjsim study`."""
    parser = add_command(commands, "controls", run, DESCRIPTION, "simulate a study's negative controls")
    add_study(parser, nargs="?", default="paper")
    parser.add_argument("--only", metavar="NAME", help="simulate only this control (default: all)")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the controls")


def run(arguments: argparse.Namespace) -> int:
    """Simulate the controls one after the other. Return 1 if a trial failed, otherwise 0.

    Raises:
        ConfigError: There is no control with the given name.
    """
    from experiments.cli.terminal import error_console
    from experiments.trials.designs import read_study, study_path
    from studies.controls import read_controls

    controls = read_controls(read_study(study_path(arguments.study), arguments.people), only=arguments.only)
    failures = 0
    for control in controls:
        out = arguments.out / control.name
        rows, failed = run_with_progress(control.design, out, arguments, control.name)
        failures += failed
        error_console().print(
            f"{control.name}: {control.about}; {len(rows)} simulated, {failed} failed: {out}"
        )
    error_console().print("`mjsim study score` compares each with the published study")
    return 1 if failures else 0
