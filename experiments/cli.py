"""The `mjsim` command: one subcommand per module of `experiments.commands`."""

import argparse
import importlib
import sys
from collections.abc import Sequence
from pathlib import Path

COMMANDS = ("run", "replay", "batch", "plan", "house", "gallery", "bench", "doctor")
FAILED = 1
USAGE_ERROR = 2
INTERRUPTED = 130

DESCRIPTION = """\
A MuJoCo physics-grounded rearrangement simulator for augmented-reality assistance research.

A person walks through a disorganized apartment in first person, picks up misplaced objects, at most two at a time,
and puts each into its bin. A heads-up display, driven by an optimal planner, assists."""

EPILOG = """\
examples:
  mjsim run --objects 6 --assistance guided --seed 0 --out runs/demo
      film one assisted trial, with metrics, event log and floor plan
  mjsim batch --objects 6,12 --assistance none,highlight,optimal --seeds 0:10 --out runs/batch
      run a factorial design on all cores; the same command continues after an interruption
  mjsim house --objects 12 --seed 3 --out house.xml
      write a disorganized house as MJCF for stock MuJoCo
  mjsim plan problem.json
      solve a pickup-and-delivery problem, with a proof of optimality where possible
  mjsim doctor
      show versions, and whether off-screen rendering works"""


def parser(command: str | None = None) -> argparse.ArgumentParser:
    """The command line.

    Args:
        command: The only command to load, so that `mjsim plan` starts fast; None for all.
    """
    top = argparse.ArgumentParser(
        prog="mjsim",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    top.add_argument("--version", action=_Version)
    commands = top.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name in COMMANDS if command is None else (command,):
        importlib.import_module(f"experiments.commands.{name}").add_parser(commands)
    return top


class _Version(argparse.Action):
    """Prints the version; looked up only then, so that all else starts fast."""

    def __init__(self, option_strings: Sequence[str], dest: str) -> None:
        super().__init__(option_strings, dest, nargs=0, help="show the version and exit")

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        from importlib.metadata import version

        print(f"mjsim {version('mjsim')}")
        parser.exit()


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0 done, 1 failed, 2 bad input, 130 interrupted."""
    words = sys.argv[1:] if argv is None else list(argv)
    if (here := str(Path.cwd())) not in sys.path:
        sys.path.append(here)  # for participants, conditions and planners of one's own
    command = words[0] if words and words[0] in COMMANDS else None
    arguments = parser(command).parse_args(words)
    try:
        return int(arguments.run(arguments))
    except KeyboardInterrupt:
        print("mjsim: interrupted; what was finished is kept", file=sys.stderr)
        return INTERRUPTED
    except Exception as error:
        code = exit_code(error)
        if code is None:
            raise
        print(f"mjsim: {error}", file=sys.stderr)
        return code


def exit_code(error: Exception) -> int | None:
    """The exit code of an error whose message is enough for the user; None for a bug, which needs its traceback."""
    # Imported only on errors, so that `mjsim plan` starts fast.
    from experiments.errors import ExperimentError
    from hud.errors import HudError
    from mjsim.errors import MjsimError, PhysicsError
    from planner.errors import PlannerError

    if isinstance(error, PhysicsError | OSError):  # a full disk, or a folder that cannot be written
        return FAILED
    return USAGE_ERROR if isinstance(error, ExperimentError | MjsimError | PlannerError | HudError) else None


if __name__ == "__main__":
    sys.exit(main())
