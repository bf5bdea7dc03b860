"""`mjsim plan`: solve a routing problem from a file."""

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from experiments.errors import ConfigError
from planner.errors import ProblemError
from planner.problem_json import claim_from_json, claim_to_json, plan_to_json, problem_from_json
from planner.solver import DEFAULT_SOLVER, PATIENT_WORK, SOLVERS, SolveLimit, solver

T = TypeVar("T")

DESCRIPTION = """\
Solve a capacitated pickup-and-delivery problem with an open tour. Input, from FILE or - for standard input:
  {"capacity": 2, "start": 0, "distances": [[0, 3, 5], [3, 0, 4], [5, 4, 0]],
   "shipments": [{"pickup": 1, "delivery": 2}], "onboard": [2]}
Indices count rows of the symmetric matrix distances, in metres; onboard holds the delivery index of each object
that is carried at the start.
Output, on standard output:
  {"visits": [1, 2, 2], "cost": 7.0, "lower_bound": 7.0, "status": "optimal", "seconds": 0.001}
Malformed input exits with 2 and one line that names the fault.

With --certificate OUT.json the visits by object and what proves the lower bound are written as well. Anybody can check
that: --check OUT.json replays the tour against the constraints, derives the bound anew and looks at every state through
which a shorter tour could run, by code that shares nothing with the planners (about a second at 24 objects). It answers
  {"holds": true, "cost": 7.0, "lower_bound": 7.0, "status": "optimal", "verified_bound": 7.0, "verified_optimal": true,
   "unverified": ""}
verified_bound is what the check saw for itself; where it is below lower_bound, unverified says why. A claim that
does not hold exits with 1."""


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
        help="seconds to search, to some 0.1 s; without it, the planner's own budget of work",
    )
    claim = parser.add_mutually_exclusive_group()
    claim.add_argument(
        "--certificate", type=Path, metavar="OUT.json", help="write what the answer claims and what proves it"
    )
    claim.add_argument(
        "--check",
        metavar="OUT.json",
        help="plan nothing: check what --certificate wrote, - for standard input",
    )
    parser.add_argument("--force", action="store_true", help="replace a certificate that exists")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Read, solve, print; or check."""
    if arguments.check is not None:
        return _check(arguments.file, arguments.check)
    if arguments.certificate is not None:
        from experiments.run_directory import check_file  # loaded only where it is needed

        check_file(arguments.certificate, replace=arguments.force)
    limit = _limit(arguments.planner, arguments.time_limit)
    problem = _read(arguments.file, problem_from_json)
    plan = solver(arguments.planner).solve(problem, limit=limit)
    if arguments.certificate is not None:
        from mjsim.files import write_text_atomically  # loaded only where it is needed

        write_text_atomically(arguments.certificate, claim_to_json(problem, plan) + "\n")
    print(plan_to_json(problem, plan))
    return 0


def _limit(planner: str, seconds: float | None) -> SolveLimit | None:
    """The time that was asked for, or a large budget of the exact planner's work."""
    if seconds is not None:
        return SolveLimit(seconds=seconds)
    return SolveLimit(work=PATIENT_WORK) if planner == DEFAULT_SOLVER else None


def _check(problem_name: str, claim_name: str) -> int:
    """Check a claim about a problem; 1 where it does not hold."""
    if problem_name == claim_name == "-":
        raise ConfigError("problem and certificate cannot both come from standard input; give a file for one")
    from planner.verifier import verify_optimal  # loaded only where it is needed

    problem = _read(problem_name, problem_from_json)
    plan = _read(claim_name, lambda text: claim_from_json(text, problem))
    try:
        seen = verify_optimal(problem, plan)
    except ProblemError as error:
        print(json.dumps({"holds": False, "fault": str(error)}))
        return 1
    claimed = {"cost": plan.cost, "lower_bound": plan.lower_bound, "status": plan.status.value}
    verified = {"verified_bound": seen.lower_bound, "verified_optimal": seen.optimal, "unverified": seen.why}
    print(json.dumps({"holds": True, **claimed, **verified}))
    return 0


def _read(name: str, parse: Callable[[str], T]) -> T:
    try:
        text = sys.stdin.read() if name == "-" else Path(name).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"cannot read {name}: {error}") from error
    try:
        return parse(text)
    except ProblemError as error:
        raise ProblemError(f"{name}: {error}") from error
