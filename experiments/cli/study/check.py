"""`mjsim study check`: check that a study is ready to start."""

import argparse
import itertools
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from experiments.cli.doctor import require_extra
from experiments.cli.options import add_command
from experiments.cli.server import prepare_process
from experiments.cli.study.database import add_study_file, checked_study
from experiments.errors import ConfigError
from experiments.session.signals import run_until_signal

if TYPE_CHECKING:
    from experiments.study.file import Study
    from experiments.study.rehearsal.dry_run import Walked
    from experiments.visit.recruiter import Recruiter
    from experiments.web.server.pool import WorkerPool

DESCRIPTION = """\
Check that a study is ready for participants. The study is served from a temporary folder, and simulated participants go
through every phase by HTTP. The server must refuse wrong or early answers, accept each right answer once, and end each
visit as intended. In this check, minimum durations are at most a second, and trials last a second.

Print the expected duration (reading time from the number of words, trials from simulated participants), the cost, and
the effect sizes that the study can detect. With --out, an installed Chromium takes a screenshot of each page in desktop
and phone size. Problems are listed with their line in the file. The exit code is 1 if there are any."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "check", run, DESCRIPTION, "check that a study is ready")
    add_study_file(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for the screenshots")
    parser.add_argument(
        "--pool",
        type=Path,
        metavar="DIR",
        help="folder of simulated participants, from which to estimate the power",
    )
    parser.add_argument("--measure", default="deviations", metavar="NAME", help="measure for --pool")


def run(arguments: argparse.Namespace) -> int:
    study = checked_study(arguments)
    require_extra("study")
    from experiments.cli.terminal import error_console, progress_bars
    from experiments.study.plan import plan_of
    from experiments.study.rehearsal.costs import durations, simulate
    from experiments.study.rehearsal.problems import located, problems_of_file, problems_of_length
    from experiments.study.validation import check_homes
    from experiments.visit.phases import phases_of
    from experiments.web.server.pool import WorkerPool

    if arguments.out is not None and arguments.out.exists() and not arguments.out.is_dir():
        raise ConfigError(f"{arguments.out} is a file; name a folder for the screenshots")
    phases = phases_of(plan_of(study, platform=_recruiter(study)))
    prepare_process()
    pool = WorkerPool(study.cells[0].trial(0).house)
    pool.warm_up()
    with progress_bars(error_console(), "{task.description}") as bars:
        bar = bars.add_task("check", total=None)
        check_homes(study, lambda name: bars.update(bar, description=f"preparing {name}"))
        with TemporaryDirectory() as folder:
            played = simulate(
                study, Path(folder), lambda name: bars.update(bar, description=f"simulating {name}")
            )
        with TemporaryDirectory() as folder:
            walk = _walk(
                study,
                _recruiter(study),
                Path(folder),
                pool,
                arguments.out,
                lambda name: bars.update(bar, description=f"going through the study: {name}"),
            )
            walked = run_until_signal(walk)
    seconds = durations(study, phases, walked.words, played)
    rest, tasks = sum(seconds.values()) - seconds["task"], played.tasks.values()
    shortest, longest = rest + min(tasks), rest + max(tasks)
    _print_length(study, seconds, shortest, longest)
    _print_cost(study)
    _print_power(study, arguments)
    found = problems_of_file(study), problems_of_length(study, shortest, longest)
    problems = [*walked.faults, *located(study, itertools.chain(*found))]
    for line in problems:
        print(f"problem   {line}")
    print(f"not ready (problems: {len(problems)})" if problems else "ready     all phases passed")
    return 1 if problems else 0


def _recruiter(study: "Study") -> "Recruiter":
    from experiments.study.recruitment import recruiter
    from experiments.visit.recruiter import OpenLink

    try:
        return recruiter(study.settings.recruitment)
    except ConfigError:  # the check reports this error as a problem with the study file
        return OpenLink()


async def _walk(
    study: "Study",
    recruiter: "Recruiter",
    folder: Path,
    pool: "WorkerPool",
    out: Path | None,
    on_page: Callable[[str], None],
) -> "Walked":
    from experiments.study.rehearsal.dry_run import dry_run
    from experiments.study.rehearsal.pictures import BROWSERS, browser, camera, write_contact_sheet

    program = None if out is None else browser()
    if out is not None and program is None:
        print(f"pictures  none, as no Chromium is installed ({', '.join(BROWSERS)})")
    async with camera(program, out) if out and program else nullcontext() as taking:

        async def photograph(name: str, url: str, content: str) -> None:
            on_page(name)
            if taking is not None:
                await taking.photograph(name, url, content)

        walked = await dry_run(study, recruiter, folder, pool, photograph)
    if out is not None and taking is not None:
        print(f"pictures  {write_contact_sheet(out, taking.taken, study.settings.title)}")
    return walked


def _print_length(study: "Study", seconds: dict[str, float], shortest: float, longest: float) -> None:
    for name, expected in seconds.items():
        print(f"length    {name:14} {_time(expected)}")
    print(
        f"length    {_time(shortest)} to {_time(longest)} by cell, with simulated people in trials; the study says "
        f"{study.settings.minutes} min"
    )


def _print_cost(study: "Study") -> None:
    from experiments.study.rehearsal.costs import cost

    pay, found = study.settings.pay, cost(study)
    print(f"cost      {study.people} people x {pay.reward:.2f} = {found.rewards:.2f} {pay.currency}")
    if found.bonuses:
        print(f"cost      bonuses of at most {found.bonuses:.2f}")
    fee = "unknown: set fee in [study.pay]" if found.fee is None else f"{found.fee:.2f}"
    print(f"cost      fee of the platform {fee}")
    print(f"cost      {found.total:.2f} {pay.currency} in total; {found.hourly:.2f} per hour and person")


def _print_power(study: "Study", arguments: argparse.Namespace) -> None:
    from experiments.study.rehearsal.costs import detectable

    for effect, size in detectable(study).items():
        print(
            f"power     {study.people} people detect an effect of {effect} of partial eta squared {size:.3f} (80 %)"
        )
    if arguments.pool is None:
        print(
            "power     for a measure, run mjsim study simulate, then mjsim study check --pool DIR (docs/analysis.md)"
        )
        return
    from experiments.analysis.planning.power import StudyCost, Wanted, plan_power
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
