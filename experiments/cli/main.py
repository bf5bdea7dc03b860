"""Entry point of the `mjsim` command, which only imports the module of the requested subcommand."""

import argparse
import faulthandler
import importlib
import os
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from experiments.cli.doctor import add_checkout_command
from experiments.cli.failures import USAGE_ERROR, drop_output, end_with, flush_output
from experiments.session.signals import exit_code, exit_raised, signal_of, signals_raised
from mjsim.support.environment import postpone_gl
from mjsim.support.urls import redacted
from mjsim.values.errors import brief

COMMANDS = {
    "run": "run one trial and film it",
    "play": "tidy the apartment yourself, in a browser",
    "replay": "replay and verify a recorded run, or film it from another view",
    "view": "view a recorded run in the browser",
    "batch": "run the trials of a design on all cores",
    "metrics": "recompute the metrics of a run or a batch",
    "unpack": "turn packed trials of a batch into run directories",
    "compare": "compare the assistance conditions of a batch",
    "study": "plan, run, simulate and analyse studies",
    "plan": "solve a routing problem from a JSON file",
    "house": "write, generate, export or show houses",
    "flythrough": "film the rooms and bins of a house",
    "check": "check a house, an object or an episode",
    "import": "import objects, houses and episodes",
    "gallery": "draw the figures of the documentation",
    "bench": "run a benchmark",
    "doctor": "show versions and check that rendering works",
    "completion": "print a completion script for a shell",
}
MODULES = {"import": "import_"}  # module names for subcommands that are named like a Python keyword
# Modules of subcommands that are only available in a source checkout
CHECKOUT = {"gallery": "tools.gallery_command", "bench": "benchmarks._command"}

DESCRIPTION = """\
A MuJoCo physics-grounded rearrangement simulator for augmented-reality assistance research.

A person walks through a disorganized apartment in first person, picks up misplaced objects, at most two at a time, and
puts each into its bin. A heads-up display, driven by an optimal planner, assists."""

EPILOG = """\
examples:
  mjsim run --objects 6 --assistance guided --seed 0 --out runs/demo
      film one assisted trial, with metrics, event log and floor plan
  mjsim play --objects 6 --assistance optimal --seed 0
      tidy the apartment yourself, in a browser
  mjsim view runs/demo
      view a run in the browser: timeline, any camera, any speed
  mjsim batch --objects 6,12 --assistance none,highlight,optimal --seeds 0:10 --out runs/batch
      run a factorial design on all cores; repeat the command after an interruption
  mjsim compare runs/batch
      compare its assistance conditions, paired by seed, with effect sizes
  mjsim study analyze runs/study
      analyse a between-subjects study: figures, tests and a report in one file
  mjsim house --objects 12 --seed 3 --out house.xml
      write a disorganized house as MJCF for stock MuJoCo, or as glTF (house.glb)
  mjsim check my_house/catalogue.toml --picture faults.png
      check a house, an object or an episode, and mark the faults in a picture
  mjsim plan problem.json
      solve a pickup-and-delivery problem, with a proof of optimality where possible
  mjsim doctor
      show versions and check that off-screen rendering works"""


def parser(*loaded: str) -> argparse.ArgumentParser:
    """Create an argument parser for the `loaded` commands. If there are none, it can only list all command names."""
    top = Parser(
        prog="mjsim",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument("--version", action=_Version)
    commands = top.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for command in loaded:
        if command in CHECKOUT:
            add_checkout_command(commands, command, CHECKOUT[command])
        else:
            importlib.import_module(f"experiments.cli.{MODULES.get(command, command)}").add_parser(commands)
    if not loaded:
        for name, summary in COMMANDS.items():
            commands.add_parser(name, help=summary)
    return top


class _Version(argparse.Action):
    """An action that prints the version. The version is only looked up when the user requests it."""

    def __init__(self, option_strings: Sequence[str], dest: str) -> None:
        super().__init__(option_strings, dest, nargs=0, help="show the version and exit")

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from importlib.metadata import version

        print(f"mjsim {version('mjsim')}")
        parser.exit()


class Parser(argparse.ArgumentParser):
    """An argument parser that prints errors on a single line."""

    def error(self, message: str) -> NoReturn:
        self.exit(USAGE_ERROR, f"mjsim: {brief(redacted(message))}; `{self.prog} --help` lists the options\n")


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code.

    The code is 0 for success, 1 for a failure, 2 for bad input, 70 for a bug, and 128 + n for signal n.
    """
    words = sys.argv[1:] if argv is None else list(argv)
    if argv is None and not sys.warnoptions:
        warnings.simplefilter("ignore")  # users should not see warnings from libraries
    postpone_gl()
    if sys.stderr is None:  # `print(file=None)` would write to standard output
        sys.stderr = Path(os.devnull).open("w", encoding="utf-8")  # noqa: SIM115 - as long as the process
    if argv is None:
        faulthandler.enable(all_threads=False)  # prints a Python traceback if the process crashes
    if sys.stdout is None:  # writing to a closed standard output must raise an error
        os.dup2(os.open(os.devnull, os.O_RDONLY), 1)
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115 - as long as the process
    with signals_raised():
        try:
            return _run(words)
        except KeyboardInterrupt as stop:
            return _stopped(stop)
        except Exception as error:
            if isinstance(error, SystemError) and isinstance(error.__cause__, KeyboardInterrupt):
                return _stopped(error.__cause__)  # the signal arrived while compiled code was returning
            return end_with(error, words)


def _stopped(stop: KeyboardInterrupt) -> int:
    number = signal_of(stop)
    print(f"mjsim: stopped by {number.name}. Finished work is kept", file=sys.stderr)
    return exit_code(number)


def _run(words: list[str]) -> int:
    known = words[:1] if words and words[0] in COMMANDS else []
    try:
        here = str(Path.cwd())
    except FileNotFoundError as error:
        raise OSError(error.errno, "the current folder was removed; change to another one") from error
    if here not in sys.path:
        sys.path.append(here)  # lets users import modules from the current folder
    commands = parser(*known)
    if bad := next((word for word in words if word.startswith("--") and word.endswith("=--")), None):
        commands.error(f"{bad} has no value")  # argparse would turn the missing value into an empty list
    # an empty path would be the current folder
    if "" in words or any(word.startswith("--") and word.endswith("=") for word in words):
        commands.error("an argument is empty; give a value, or leave it out")
    try:
        arguments = commands.parse_args(words)
    except SystemExit:
        flush_output()
        raise
    if "numba" in sys.modules:
        from experiments.trials.warmup import announce_compiling

        announce_compiling()
    with exit_raised():
        code = int(arguments.run(arguments))
    if sys.stdout is not None:
        try:
            sys.stdout.flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            drop_output()
            raise OSError(error.errno, f"cannot write to standard output: {error.strerror}") from error
    return code


if __name__ == "__main__":
    sys.exit(main())
