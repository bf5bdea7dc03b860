"""`mjsim study rehearse`: a whole study with simulated people, before real ones come."""

import argparse
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_command
from experiments.cli.requirements import require_extra
from experiments.cli.server import number
from experiments.cli.study.database import DATABASE, people_study, sqlite_url
from experiments.errors import ConfigError
from experiments.session.signals import run_until_signal

if TYPE_CHECKING:
    from experiments.study.file import Study
    from experiments.study.rehearsal.person import Rehearsed
    from experiments.study.rehearsal.report import RehearsalReport
    from experiments.study.rehearsal.run import RehearsalSettings

SHOWN = 20  # faults that are printed
DESCRIPTION = """\
Send simulated people through the whole study: the real server (OUT/served), its pages by HTTP, its trials by WebSocket.
They arrive at random, answer at random, leave, come back, reload, lose the connection, and send things twice. Waiting
takes 1/FACTOR of its time, and trials run as fast as they are played, but for every twentieth person, who plays in real
time. Everything they leave is marked as a rehearsal; `collect` and `serve` keep it apart from people.

Then writes the tables (OUT/table), the export (OUT/export), the analysis (OUT/analysis) and OUT/rehearsal.json: what
went wrong. `mjsim study pay` asks for it before anybody is paid. An interrupted rehearsal is continued by the same
command."""


def add_parser(commands: Any) -> None:
    parser = add_command(
        commands, "rehearse", run, summary="a whole study with simulated people", description=DESCRIPTION
    )
    parser.add_argument("study", metavar="STUDY.toml", help="study file, or `paper`")
    parser.add_argument("--out", type=Path, required=True, metavar="OUT", help="folder of the rehearsal")
    parser.add_argument("--people", type=number(1, 100_000), metavar="N", help="(default: as many as wanted)")
    parser.add_argument("--seed", type=number(0, 2**53), default=0, help="of people (default: %(default)s)")
    parser.add_argument(
        "--per-minute", type=_positive, default=2.0, metavar="N", help="arrivals (default: %(default)s)"
    )
    parser.add_argument(
        "--dropouts", type=_share, default=0.2, metavar="SHARE", help="who leave (default: %(default)s)"
    )
    parser.add_argument(
        "--factor", type=_positive, default=20.0, help="by which waiting is shorter (default: %(default)s)"
    )
    parser.add_argument(
        "--film", type=Path, metavar="FILE.mp4", help="film of the house (default: made once)"
    )


def run(arguments: argparse.Namespace) -> int:
    """Rehearse; 1 if something went wrong."""
    study = people_study(arguments)
    require_extra("study")
    from experiments.study.rehearsal.report import REPORT
    from experiments.study.rehearsal.run import RehearsalSettings

    people = arguments.people or study.people
    settings = RehearsalSettings(
        study.sha256, people, arguments.seed, arguments.per_minute, arguments.dropouts, arguments.factor
    )
    found = run_until_signal(_run(study, settings, arguments))
    for fault in found.faults[:SHOWN]:
        print(fault)
    if len(found.faults) > SHOWN:
        print(f"and {len(found.faults) - SHOWN} more")
    for what, count in sorted(found.outcomes.items()):
        print(f"{count:6d} {what}")
    print(f"finished by cell: {', '.join(str(count) for count in found.cells.values())}")
    print(f"{found.owed / 100:.2f} {study.settings.pay.currency} would be owed")
    _analyse(study, arguments.out)
    print(f"{'passed' if found.passed else 'NOT PASSED'}: {arguments.out / REPORT}")
    return 0 if found.passed else 1


async def _run(
    study: "Study", settings: "RehearsalSettings", arguments: argparse.Namespace
) -> "RehearsalReport":
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn

    from experiments.cli.terminal import error_console, progress_bars
    from experiments.study.rehearsal.report import report
    from experiments.study.rehearsal.run import SERVED, rehearse
    from experiments.visit.store import Store

    columns = TextColumn("people"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    outcomes: Counter[str] = Counter()
    with progress_bars(error_console(), *columns, TextColumn("{task.fields[outcomes]}")) as bars:
        bar = bars.add_task("people", total=settings.people, outcomes="")

        def show(rehearsed: "Rehearsed") -> None:
            outcomes[rehearsed.outcome] += 1
            text = ", ".join(f"{count} {what}" for what, count in outcomes.most_common(3))
            bars.update(bar, completed=outcomes.total(), outcomes=text)

        people = await rehearse(study, settings, arguments.out, arguments.film, show)
    url = sqlite_url(arguments.out / SERVED / DATABASE)
    store = await Store.open(url, study.settings.name, study.sha256)
    try:
        return await report(study, settings, store, people, arguments.out)
    finally:
        await store.close()


def _analyse(study: "Study", out: Path) -> None:
    """Analyse as real people are analysed; too few people for that are no fault of the study."""
    from experiments.cli.study import analyze
    from experiments.errors import RecordError
    from experiments.study.rehearsal.report import TABLE

    exclude = None if study.exclusions is None else study.path
    given = {"exclude": exclude, "preregistration": None, "measures": None, "force": True}
    try:
        analyze.run(argparse.Namespace(folder=out / TABLE, out=out / "analysis", **given))
    except (ConfigError, RecordError) as error:
        print(f"no analysis: {error}")


def _positive(text: str) -> float:
    value = float(text)
    if not 0.0 < value < 1e6:
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return value


def _share(text: str) -> float:
    value = float(text)
    if not 0.0 <= value <= 1.0:
        raise argparse.ArgumentTypeError(f"{text} is not from 0 to 1")
    return value
