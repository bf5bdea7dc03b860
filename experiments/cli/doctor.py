"""`mjsim doctor`: is everything there that a run needs?"""

import argparse
from typing import Any

DESCRIPTION = """\
Show versions, the EGL vendor and the GL renderer, whether rendering happens in software, and what to install when
something is missing. Names other software whose packages are called planner, hud or experiments as ours are.
Exits with 1 when frames cannot be rendered, something is missing, or Python imports another package than ours."""


def add_parser(commands: Any) -> None:
    parser: argparse.ArgumentParser = commands.add_parser(
        "doctor",
        help=None,  # lets completion list it
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:  # noqa: ARG001 - every subcommand takes them
    from mjsim.render.diagnostics import environment_report

    report = environment_report()
    for line in report.lines():
        print(line)
    return 0 if report.usable else 1
