"""The `mjsim` command: one subcommand per module of `experiments.commands`."""

import argparse
import importlib
import sys
from collections.abc import Sequence

COMMANDS = ("run", "replay", "batch", "plan", "house", "gallery", "bench", "doctor")
FAILED = 1
USAGE_ERROR = 2
INTERRUPTED = 130

DESCRIPTION = """\
A MuJoCo physics-grounded rearrangement simulator for augmented-reality assistance research.

A person walks through a disorganized apartment in first person, picks up misplaced objects, at most two at a time,
and puts each into its bin, helped by a heads-up display that an optimal planner drives."""

EPILOG = """\
examples:
  mjsim run --objects 6 --assistance optimal --seed 0 --out runs/demo
      film one assisted clean-up, with metrics, event log and floor plan beside it
  mjsim batch --objects 6,12 --assistance none,highlight,optimal --seeds 0:10 --out runs/batch
      run a factorial design on all cores; run it again to go on after an interruption
  mjsim house --objects 12 --seed 3 --out house.xml
      write a disorganized house that stock MuJoCo loads
  mjsim plan problem.json
      solve a pickup-and-delivery problem, proven optimal where that is possible
  mjsim doctor
      show versions and whether off-screen rendering works"""


def parser(command: str | None = None) -> argparse.ArgumentParser:
    """The command line.

    Args:
        command: Leave out all other commands: `mjsim plan` need not load the renderer to answer at once.
    """
    top = argparse.ArgumentParser(
        prog="mjsim",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = top.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name in COMMANDS if command is None else (command,):
        importlib.import_module(f"experiments.commands.{name}").add_parser(commands)
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0 done, 1 failed, 2 bad input, 130 interrupted."""
    words = sys.argv[1:] if argv is None else list(argv)
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
    """The exit code of an error whose message says what to do; None for any other."""
    # Loaded only now, as `mjsim plan` is to answer at once: importing mjsim loads Gymnasium.
    from experiments.errors import ExperimentError
    from hud.errors import HudError
    from mjsim.errors import MjsimError, PhysicsError
    from planner.errors import PlannerError

    if isinstance(error, PhysicsError):
        return FAILED
    return USAGE_ERROR if isinstance(error, ExperimentError | MjsimError | PlannerError | HudError) else None


if __name__ == "__main__":
    sys.exit(main())
