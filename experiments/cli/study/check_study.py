"""`mjsim study check`: whether a study is ready for people."""

import argparse
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_command
from experiments.cli.requirements import require_extra
from experiments.cli.server import prepare_process
from experiments.cli.study.database import people_study
from experiments.errors import ConfigError
from experiments.session.signals import run_until_signal

if TYPE_CHECKING:
    from experiments.study.file import Study
    from experiments.study.rehearsal.dry_run import Walked
    from experiments.visit.recruiter import Recruiter
    from experiments.web.server.pool import WorkerPool

DESCRIPTION = """\
Check a study before people come. It is served in a folder that is thrown away, and made-up people go through every
phase by HTTP: what is wrong or too early must be refused, what is right taken once, and every way out must end where
it should. Minimum times are at most a second here, and trials last a second.

Prints the expected length (reading by words, trials by simulated people), what the study costs, and which effects it
can find. With --out, a Chromium that is installed takes a picture of each page, as on a desk and on a phone. Problems
are listed with their line of the file; the exit code is 1 if there is one."""


def add_parser(commands: Any) -> None:
    parser = add_command(
        commands, "check", run, summary="whether a study is ready for people", description=DESCRIPTION
    )
    parser.add_argument("study", metavar="STUDY.toml", help="study file, or `paper`")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder of the pictures")
    parser.add_argument(
        "--pool", type=Path, metavar="DIR", help="simulated people, for the power of `mjsim study power`"
    )
    parser.add_argument(
        "--measure", default="deviations", metavar="NAME", help="of --pool (default: deviations)"
    )


def run(arguments: argparse.Namespace) -> int:
    """Check; 1 if there is a problem."""
    study = people_study(arguments)
    require_extra("study")
    from experiments.study.plan import plan_of
    from experiments.study.rehearsal.costs import durations, simulate
    from experiments.study.rehearsal.problems import located, problems_of_file, problems_of_length
    from experiments.visit.phases import phases_of
    from experiments.web.server.pool import WorkerPool

    if arguments.out is not None and arguments.out.exists() and not arguments.out.is_dir():
        raise ConfigError(f"{arguments.out} is a file; name a folder for the pictures")
    phases = phases_of(plan_of(study, platform=_recruiter(study)))
    prepare_process()
    pool = WorkerPool(study.cells[0].trial(0).house)
    pool.warm_up()
    with TemporaryDirectory() as folder:
        played = simulate(study, Path(folder), lambda name: _progress(f"simulating {name}"))
    with TemporaryDirectory() as folder:
        _progress("going through the study")
        walked = run_until_signal(_walk(study, _recruiter(study), Path(folder), pool, arguments.out))
    _progress("")
    seconds = durations(study, phases, walked.words, played)
    rest, tasks = sum(seconds.values()) - seconds["task"], played.tasks.values()
    shortest, longest = rest + min(tasks), rest + max(tasks)
    _print_length(study, seconds, shortest, longest)
    _print_cost(study)
    _print_power(study, arguments)
    problems = [*problems_of_file(study), *problems_of_length(study, shortest, longest)]
    for line in (*walked.faults, *located(study, problems)):
        print(f"problem   {line}")
    found = len(walked.faults) + len(problems)
    print("ready     every phase was gone through" if not found else f"not ready ({found} to put right)")
    return 1 if found else 0


def _recruiter(study: "Study") -> "Recruiter":
    """The study's platform, or an open link where its codes are missing."""
    from experiments.study.recruitment import recruiter
    from experiments.visit.recruiter import OpenLink

    try:
        return recruiter(study.settings.recruitment)
    except ConfigError:  # listed as a problem of the file
        return OpenLink()


async def _walk(
    study: "Study", recruiter: "Recruiter", folder: Path, pool: "WorkerPool", out: Path | None
) -> "Walked":
    from experiments.study.rehearsal.dry_run import dry_run
    from experiments.study.rehearsal.pictures import BROWSERS, browser, camera, write_contact_sheet

    async def nothing(name: str, url: str) -> None:
        pass

    if out is None:
        return await dry_run(study, recruiter, folder, pool, nothing)
    if (program := browser()) is None:
        print(f"pictures  none, as no Chromium is installed ({', '.join(BROWSERS)})")
        return await dry_run(study, recruiter, folder, pool, nothing)
    async with camera(program, out) as taking:
        walked = await dry_run(study, recruiter, folder, pool, taking.photograph)
    _progress("")
    print(f"pictures  {write_contact_sheet(out, taking.taken, study.settings.title)}")
    return walked


def _progress(text: str) -> None:
    """One line on a terminal that is written over again."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)


def _print_length(study: "Study", seconds: dict[str, float], shortest: float, longest: float) -> None:
    for name, expected in seconds.items():
        print(f"length    {name:14} {_time(expected)}")
    print(
        f"length    {_time(shortest)} to {_time(longest)} by cell, with simulated people in trials; people are told "
        f"{study.settings.minutes} min"
    )


def _print_cost(study: "Study") -> None:
    from experiments.study.rehearsal.costs import cost

    pay, found = study.settings.pay, cost(study)
    print(f"cost      {study.people} people x {pay.reward:.2f} = {found.rewards:.2f} {pay.currency}")
    if found.bonuses:
        print(f"cost      bonuses of at most {found.bonuses:.2f}")
    fee = "not known: set fee in [study.pay]" if found.fee is None else f"{found.fee:.2f}"
    print(f"cost      fee of the platform {fee}")
    print(f"cost      {found.total:.2f} {pay.currency} in all; {found.hourly:.2f} an hour for each person")


def _print_power(study: "Study", arguments: argparse.Namespace) -> None:
    from experiments.study.rehearsal.costs import detectable

    for effect, size in detectable(study).items():
        print(
            f"power     {study.people} people show an effect of {effect} of partial eta squared {size:.3f} (80 %)"
        )
    if arguments.pool is None:
        print(
            "power     for a measure: mjsim study simulate, then mjsim study check --pool DIR (docs/analysis.md)"
        )
        return
    from experiments.analysis.planning.cost import StudyCost
    from experiments.analysis.planning.power import Wanted, plan_power
    from experiments.analysis.study.measures import read_measures
    from experiments.analysis.study.table import read_study

    cells = [(cell.trials[0].assistance, cell.trials[0].objects) for cell in study.cells]
    wanted = Wanted(arguments.measure)
    plan = plan_power(cells, read_study(arguments.pool, read_measures()), wanted, StudyCost())
    smallest = min(len(cell.trials) for cell in study.cells)
    print(
        f"power     {wanted.effect} on {wanted.measure} needs {plan.per_cell} people in each cell for 80 %; "
        f"the smallest has {smallest}"
    )


def _time(seconds: float) -> str:
    return f"{int(seconds) // 60} min {int(seconds) % 60:02d} s"
