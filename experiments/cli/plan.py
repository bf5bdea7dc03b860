"""`mjsim plan`: solve a routing problem from a JSON file."""

import argparse
import gc
import json
import math
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

from experiments.errors import ConfigError
from mjsim.support.files import read_bytes, read_stream
from planner.errors import PlannerError, ProblemError
from planner.plan import Plan, Status
from planner.problem import RoutingProblem
from planner.problem_json import claim_from_json, claim_to_json, plan_to_json, problem_from_json
from planner.solvers import DEFAULT_SOLVER, PATIENT_WORK, SOLVERS, SolveLimit, Solver, solver

T = TypeVar("T")
GRACE_S = 0.15  # maximum time that a planner may take to stop after its time limit
REPORT_PERIOD_S = 5.0  # interval between progress reports

DESCRIPTION = """\
Solve a capacitated pickup-and-delivery problem with an open tour. The input comes from FILE.json, or from standard
input if it is -:
  {"capacity": 2, "start": 0, "distances": [[0, 3, 5], [3, 0, 4], [5, 4, 0]],
   "shipments": [{"pickup": 1, "delivery": 2}], "onboard": [2]}
Indices refer to rows of the symmetric matrix distances, in metres or any other unit. onboard has the delivery index of
each object that is carried at the start. The answer goes to standard output:
  {"visits": [1, 2, 2], "cost": 7.0, "lower_bound": 7.0, "status": "optimal", "seconds": 0.001}
"optimal" means that no tour is shorter than cost by more than a billionth of it, whatever the scale of the distances.
The exact planner proves tours for capacity 1 and 2, up to 60 objects and distances that satisfy the triangle
inequality. OR-Tools plans all other problems without a proof, and a line on standard error says so.

Progress of a long search goes to standard error. Ctrl-C or SIGTERM ends the search with the best tour so far. Malformed
input gives exit code 2 and one line that describes the fault.

--certificate OUT.json also writes the visits by object and the proof of the lower bound. --check OUT.json verifies such
a certificate with code that is independent of the planners: it checks the tour against the constraints, derives the
bound again, and examines every state through which a shorter tour could lead (about a second for 24 objects). It
prints:
  {"holds": true, "cost": 7.0, "lower_bound": 7.0, "status": "optimal", "verified_bound": 7.0, "verified_optimal": true,
   "unverified": ""}
verified_bound is the bound that was derived. If it is below lower_bound, unverified says why. A certificate that does
not hold gives exit code 1."""


def add_parser(commands: Any) -> None:
    parser: argparse.ArgumentParser = commands.add_parser(
        "plan",
        help="solve a routing problem from a JSON file",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("file", metavar="FILE.json", help="problem to solve, or - for standard input")
    parser.add_argument(
        "--planner",
        default=DEFAULT_SOLVER,
        metavar="NAME",
        help=f"{', '.join(SOLVERS)}, or package.module:attribute (default: {DEFAULT_SOLVER})",
    )
    parser.add_argument(
        "--time-limit",
        type=float,
        metavar="S",
        help="time limit in seconds, accurate to half a second (default: none, but a limit on the planner's work)",
    )
    claim = parser.add_mutually_exclusive_group()
    claim.add_argument(
        "--certificate", type=Path, metavar="OUT.json", help="also write the answer with its proof"
    )
    claim.add_argument(
        "--check",
        metavar="OUT.json",
        help="plan nothing: verify a certificate, or - for standard input",
    )
    parser.add_argument("--force", action="store_true", help="replace an existing certificate")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    if arguments.check is not None:
        if arguments.time_limit is not None:
            raise ConfigError("--check plans nothing; leave out --time-limit")
        return _check(arguments.file, arguments.check)
    if arguments.certificate is not None:
        from experiments.record.run_directory import check_file  # imported here to speed up the start

        check_file(arguments.certificate, replace=arguments.force)
        if arguments.certificate.resolve() == Path(arguments.file).resolve():
            raise ConfigError(
                f"{arguments.certificate} is the problem; name another file for the certificate"
            )
    started, seconds = time.perf_counter(), arguments.time_limit
    if seconds is not None and not 0 < seconds < math.inf:
        raise ConfigError(f"--time-limit {seconds:g} must be positive and finite; give seconds")
    problem, planner = _read(arguments.file, problem_from_json), _planner(arguments.planner)
    search = _PlanningThread(planner, problem, started, seconds)
    try:
        plan = search.wait()
    except KeyboardInterrupt:
        if search.best is not None:
            print("mjsim: stopped early; this is the best tour so far", file=sys.stderr)
            _publish(problem, search.best, arguments.certificate)
        raise
    finally:
        search.end()
        gc.freeze()  # saves 0.2 s at exit, because numba's objects are not garbage-collected
    if not search.answered:
        print(
            f"mjsim: {arguments.planner} gave no plan in time; this tour always visits the nearest place next",
            file=sys.stderr,
        )
    reason = planner.why_not(problem) if hasattr(planner, "why_not") else ""
    if reason and plan.status is not Status.OPTIMAL:
        print(f"mjsim: planned by OR-Tools, not proven optimal: {reason}", file=sys.stderr)
    _publish(problem, plan, arguments.certificate)
    return 0


def _planner(name: str) -> Solver:
    if name in SOLVERS:
        return solver(name)
    from experiments.session.own_planner import planner_named

    return planner_named(name, exact=False)


class _PlanningThread(threading.Thread):
    """A thread that runs the planner while the main thread handles time limits and signals.

    Attributes:
        best: The most recent plan, or None if there is none yet.
        answered: True if the planner itself returned a plan in time.
    """

    def __init__(
        self, planner: Solver, problem: RoutingProblem, started: float, seconds: float | None
    ) -> None:
        super().__init__(daemon=True)
        self.best: Plan | None = None
        self.answered = False
        self._error: BaseException | None = None
        self._stop_planning = threading.Event()
        self._over = threading.Event()  # used instead of `join`, because signals interrupt `join`
        self._planner, self._problem = planner, problem
        self._since, self._seconds = started, seconds

    def run(self) -> None:
        try:
            for plan in self._plans():
                # if there is a time limit, the first plan comes from a greedy heuristic
                self.answered = self.best is not None or self._seconds is None
                self.best = plan
        except BaseException as error:  # custom planners may raise any exception
            self._error = error
        finally:
            self._over.set()

    def _plans(self) -> Iterator[Plan]:
        seconds = self._seconds
        if seconds is not None:
            from planner.greedy_solver import first_plan

            yield first_plan(self._problem)
            seconds = max(0.001, self._since + seconds - time.perf_counter())
        work = PATIENT_WORK if self._planner.name == DEFAULT_SOLVER and seconds is None else None
        limit = SolveLimit(work, seconds, self._stop_planning)
        if hasattr(self._planner, "improve"):
            yield from self._planner.improve(self._problem, limit=limit)
        else:
            yield self._planner.solve(self._problem, limit=limit)

    def wait(self) -> Plan:
        """Wait until the search has ended or timed out, and return the best plan. Re-raise errors of the planner."""
        self.start()
        ends = float("inf") if self._seconds is None else self._since + self._seconds + GRACE_S
        report = self._since + REPORT_PERIOD_S
        while not self._over.is_set() and (self.best is None or time.perf_counter() < ends):
            self._over.wait(max(0.01, min(ends, report) - time.perf_counter()))
            if time.perf_counter() >= report:
                self._report()
                report += REPORT_PERIOD_S
        if self._error is not None:
            raise self._error
        if self.best is None:
            raise PlannerError(f"planner {self._planner.name!r} found no tour")
        return self.best

    def end(self) -> None:
        self._stop_planning.set()
        self._over.wait(1.0)

    def _report(self) -> None:
        text = f"planning for {time.perf_counter() - self._since:.0f} s"
        if (best := self.best) is not None:
            gap = 100 * (1 - best.lower_bound / best.cost) if best.cost else 0.0
            text += f"; the best tour so far is {best.cost:.6g} long, at most {gap:.2g} % of it too much"
        print(f"mjsim: {text}", file=sys.stderr, flush=True)


def _publish(problem: RoutingProblem, plan: Plan, certificate: Path | None) -> None:
    if certificate is not None:
        from mjsim.support.files import write_text_atomically

        write_text_atomically(certificate, claim_to_json(problem, plan) + "\n")
    print(plan_to_json(problem, plan))


def _check(problem_name: str, claim_name: str) -> int:
    if problem_name == claim_name == "-":
        raise ConfigError("problem and certificate cannot both come from standard input; give a file for one")
    from planner.checker import verify_optimal

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


def _standard_input() -> bytes:
    if sys.stdin is None:
        raise ConfigError("standard input is closed; give a file, or open it")
    return read_stream(sys.stdin.fileno())


def _read(name: str, parse: Callable[[bytes], T]) -> T:
    try:
        text = _standard_input() if name == "-" else read_bytes(Path(name))
    except OSError as error:
        what = "standard input" if name == "-" else name
        raise ConfigError(f"cannot read {what}: {error.strerror}") from error
    try:
        return parse(text)
    except ProblemError as error:
        raise ProblemError(f"{name}: {error}") from error
