"""The `mjsim` command: one subcommand per module of `experiments.commands`."""

import argparse
import sys
from collections.abc import Sequence

from experiments.commands import batch, doctor, gallery, house, replay, run
from experiments.errors import ExperimentError
from hud.errors import HudError
from mjsim.errors import MjsimError
from planner.errors import PlannerError

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
  mjsim doctor
      show versions and whether off-screen rendering works"""


def parser() -> argparse.ArgumentParser:
    """The whole command line."""
    top = argparse.ArgumentParser(
        prog="mjsim",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = top.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for module in (run, replay, batch, house, gallery, doctor):
        module.add_parser(commands)
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0 done, 1 failed, 2 bad input, 130 interrupted."""
    arguments = parser().parse_args(argv)
    try:
        return int(arguments.run(arguments))
    except (ExperimentError, MjsimError, PlannerError, HudError) as error:
        print(f"mjsim: {error}", file=sys.stderr)
        return USAGE_ERROR
    except KeyboardInterrupt:
        print("mjsim: interrupted; what was finished is kept", file=sys.stderr)
        return INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
