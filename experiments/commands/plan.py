"""`mjsim plan`: solve a routing problem from a file."""

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

from experiments.errors import ConfigError
from experiments.plan_process import Answer, PlanProcess
from planner.errors import ProblemError
from planner.plan import Plan
from planner.problem import RoutingProblem
from planner.problem_json import claim_from_json, claim_to_json, plan_to_json, problem_from_json
from planner.solver import DEFAULT_SOLVER, PATIENT_WORK, SOLVERS, SolveLimit, solver

T = TypeVar("T")

DESCRIPTION = """\
Solve a capacitated pickup-and-delivery problem with an open tour. Input, from FILE or - for standard input:
  {"capacity": 2, "start": 0, "distances": [[0, 3, 5], [3, 0, 4], [5, 4, 0]],
   "shipments": [{"pickup": 1, "delivery": 2}], "onboard": [2]}
Indices count rows of the symmetric matrix distances, in metres or any other unit; onboard holds the delivery index of
each object that is carried at the start.
Output, on standard output:
  {"visits": [1, 2, 2], "cost": 7.0, "lower_bound": 7.0, "status": "optimal", "seconds": 0.001}
"optimal" says that no tour is shorter than cost by more than a billionth of it, whatever the scale of the distances.
Progress of a long search goes to standard error. Ctrl-C or SIGTERM ends it with the best tour so far. Malformed input
exits with 2 and one line that names the fault.

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
        help="seconds from start to answer, to half a second; without it, the planner's own budget of work",
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
        from experiments.runs.run_directory import check_file  # loaded only where it is needed

        check_file(arguments.certificate, replace=arguments.force)
    seconds = arguments.time_limit
    started = time.perf_counter()
    if seconds is not None:
        SolveLimit(seconds=seconds)  # refuses what is no limit

    def answers() -> Iterator[Answer]:
        problem = _read(arguments.file, problem_from_json)
        left = None if seconds is None else max(0.001, seconds - (time.perf_counter() - started))
        for plan in _plans(arguments.planner, problem, left):
            claim = claim_to_json(problem, plan)
            yield Answer(plan_to_json(problem, plan), claim, plan.cost, plan.lower_bound)

    process = PlanProcess(answers, seconds)
    try:
        _publish(process.wait(sys.stderr), arguments.certificate)
    except KeyboardInterrupt:
        process.stop()
        if process.best is not None:
            print("mjsim: stopped early; this is the best tour so far", file=sys.stderr)
            _publish(process.best, arguments.certificate)
        raise
    return 0


def _plans(name: str, problem: RoutingProblem, seconds: float | None) -> Iterator[Plan]:
    """Better and better plans, within a time or a large budget of the exact planner's work."""
    limit = SolveLimit(work=PATIENT_WORK) if name == DEFAULT_SOLVER else None
    if seconds is not None:
        from planner.greedy_solver import first_plan  # loaded only where it is needed

        limit = SolveLimit(seconds=seconds)
        yield first_plan(problem)  # before the planner is loaded
    planner = solver(name)
    if hasattr(planner, "improve"):
        yield from planner.improve(problem, limit=limit)
    else:
        yield planner.solve(problem, limit=limit)


def _publish(answer: Answer, certificate: Path | None) -> None:
    if certificate is not None:
        from mjsim.files import write_text_atomically  # loaded only where it is needed

        write_text_atomically(certificate, answer.claim + "\n")
    print(answer.plan)


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


def _read(name: str, parse: Callable[[bytes], T]) -> T:
    try:
        text = sys.stdin.buffer.read() if name == "-" else Path(name).read_bytes()
    except OSError as error:
        raise ConfigError(f"cannot read {name}: {error.strerror}") from error
    try:
        return parse(text)
    except ProblemError as error:
        raise ProblemError(f"{name}: {error}") from error
