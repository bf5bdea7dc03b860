"""`mjsim run`: one trial, filmed."""

import argparse
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from experiments.commands.options import (
    add_fidelity,
    add_frame,
    add_house,
    add_planner,
    add_regret,
    add_user,
    assistance_help,
)
from experiments.first_person import FilmConfig
from experiments.session import Progress as SessionProgress
from experiments.trial import TrialConfig, run_trial

SHOWN = (
    ("delivered", "objects delivered", "{}"),
    ("completion_time_s", "completion time", "{:.1f} s"),
    ("task_distance_m", "distance walked", "{:.1f} m"),
    ("optimal_distance_m", "planned at the start", "{:.1f} m"),
    ("inverse_path_length", "inverse path length", "{:.3f}"),
    ("normalized_deviations", "normalized deviations", "{:.3f}"),
    ("regretful_visits", "visits that cost extra", "{}"),
    ("total_regret_m", "what they cost", "{:.2f} m"),
    ("replans", "replans", "{}"),
    ("refusals", "refusals", "{}"),
    ("max_penetration_m", "deepest penetration", "{:.4f} m"),
    ("ejections", "objects ejected", "{}"),
    ("tunnellings", "objects tunnelled", "{}"),
    ("wall_s", "wall time", "{:.1f} s"),
)

SHOW_EVERY = 1.0  # s of simulated time from one update of the progress bar to the next

DESCRIPTION = """\
Run one trial: a simulated person tidies a disorganized apartment under an assistance condition. Writes to --out
  episode.json     the disorganized house            metrics.json   the paper's metrics and the health of the physics
  events.jsonl     everything that happened          plan.json      every plan that was made
  trajectory.npz   poses and actions, 25 per second  topdown.png    floor plan with planned and walked path
  video.mp4        what the person saw
Equal options and seeds give equal frames and files (but for the wall time in metrics.json).

With --live the assistant plans as it does beside a person. Before the clock starts, while a person would look
around, it plans the task and proves the plan. After a deviation it shows a plan within some 50 ms and goes on looking
for a shorter one in a thread; no control step waits for that. What is found depends on the machine, so such a run does
not repeat; events.jsonl and plan.json hold every plan that was shown ("improved": found later for the same task, no
replan), and `mjsim replay` shows these."""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "run",
        help="run one trial and film it",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--objects", type=int, default=6, metavar="N", help="misplaced objects, 1 to 40 (6)")
    parser.add_argument(
        "--assistance", default="optimal", metavar="NAME", help=f"{assistance_help()} (optimal)"
    )
    add_user(parser)
    parser.add_argument(
        "--seed", type=int, default=0, metavar="S", help="seed of house, lists and participant (0)"
    )
    add_house(parser)
    add_planner(parser)
    add_fidelity(parser)
    parser.add_argument(
        "--live",
        action="store_true",
        help="plan against the clock, with proofs in the background, as for a person (see above)",
    )
    add_regret(parser)
    parser.add_argument(
        "--time-limit", type=float, metavar="S", help="simulated seconds after which the trial ends"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="run directory to write")
    parser.add_argument("--no-video", action="store_true", help="do not film; some 10 times quicker")
    add_frame(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the trial, show progress, then the metrics."""
    config = TrialConfig(
        objects=arguments.objects,
        assistance=arguments.assistance,
        seed=arguments.seed,
        user=arguments.user,
        house=arguments.house,
        planner=arguments.planner,
        time_limit=arguments.time_limit,
        live=arguments.live,
        fidelity=arguments.fidelity,
        regret=arguments.regret,
    )
    film = None if arguments.no_video else FilmConfig(arguments.size[0], arguments.size[1], arguments.profile)
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("delivered, {task.fields[clock]:.0f} s simulated in"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console) as bars:
        bar = bars.add_task(f"{config.assistance}, {config.user_name}", total=config.objects, clock=0.0)

        shown = SessionProgress(-SHOW_EVERY, 0, 0)

        def show(progress: SessionProgress) -> None:
            nonlocal shown
            if progress.delivered != shown.delivered or progress.time >= shown.time + SHOW_EVERY:
                shown = progress
                bars.update(bar, completed=progress.delivered, clock=progress.time)

        metrics = run_trial(config, arguments.out, film=film, on_progress=show)
    _show_metrics(console, metrics, arguments.out)
    return 130 if metrics["ended"] == "interrupted" else 0


def _show_metrics(console: Console, metrics: dict[str, Any], out: Path) -> None:
    table = Table(show_header=False, box=None)
    for key, label, form in SHOWN:
        value = "unknown" if metrics[key] is None else form.format(metrics[key])
        table.add_row(label, value + (f" of {metrics['objects']}" if key == "delivered" else ""))
    console.print(table)
    if metrics["ended"] != "all delivered":
        console.print(f"ended early: {metrics['ended']}")
    names = ", ".join(sorted(p.name for p in out.iterdir()))
    console.print(f"{out}: {names}", highlight=False, soft_wrap=True)
