"""`mjsim plan`: solve a routing problem from a file."""

import argparse
import sys
from pathlib import Path
from typing import Any

from experiments.errors import ConfigError
from planner.errors import ProblemError
from planner.problem_json import plan_to_json, problem_from_json
from planner.solver import DEFAULT_SOLVER, SOLVERS, SolveLimit, solver

DESCRIPTION = """\
Solve a capacitated pickup-and-delivery problem with an open tour. Input, from FILE or - for standard input:
  {"capacity": 2, "start": 0, "distances": [[0, 3, 5], [3, 0, 4], [5, 4, 0]],
   "shipments": [{"pickup": 1, "delivery": 2}], "onboard": [2]}
Indices count rows of the symmetric matrix distances, in metres; onboard holds the delivery index of each object
that is carried at the start.
Output, on standard output:
  {"visits": [2, 1, 2], "cost": 13.0, "lower_bound": 13.0, "status": "optimal", "seconds": 0.001}
Malformed input exits with 2 and one line that names the fault."""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "plan",
        help="solve a routing problem from a JSON file",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("file", metavar="FILE.json", help="problem to solve, - for standard input")
    parser.add_argument(
        "--planner", default=DEFAULT_SOLVER, metavar="NAME", help=f"{', '.join(SOLVERS)} ({DEFAULT_SOLVER})"
    )
    parser.add_argument(
        "--time-limit",
        type=float,
        metavar="S",
        help="seconds to search; without it, the planner's own budget of work",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Read, solve, print."""
    limit = SolveLimit(seconds=arguments.time_limit) if arguments.time_limit is not None else None
    problem = _read(arguments.file)
    print(plan_to_json(solver(arguments.planner).solve(problem, limit=limit)))
    return 0


def _read(name: str) -> Any:
    try:
        text = sys.stdin.read() if name == "-" else Path(name).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"cannot read {name}: {error}") from error
    try:
        return problem_from_json(text)
    except ProblemError as error:
        raise ProblemError(f"{name}: {error}") from error
