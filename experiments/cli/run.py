"""`mjsim run`: run a single trial and record a video of it."""

import argparse
import signal
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cli.options import (
    add_call_limit,
    add_command,
    add_force,
    add_frame,
    add_setting,
    add_task_options,
    add_trial_options,
    film_config,
    given_options,
    trial_options,
)
from experiments.record.phases import INTERRUPTED
from experiments.session.signals import exit_code
from experiments.trials.trial_config import TrialConfig

if TYPE_CHECKING:
    from rich.console import Console

SHOWN_METRICS = (
    ("delivered", "objects delivered", "{}"),
    ("completion_time_s", "completion time", "{:.1f} s"),
    ("task_distance_m", "distance walked", "{:.1f} m"),
    ("planned_distance_m", "distance planned at the start", "{:.1f} m"),
    ("ipl_locations", "inverse path length (ipl_locations)", "{:.3f}"),
    ("nd_feasible", "normalized deviations (nd_feasible)", "{:.3f}"),
    ("regretful_visits", "visits with regret", "{}"),
    ("total_regret_m", "total regret", "{:.2f} m"),
    ("replans", "replans", "{}"),
    ("refusals", "refusals", "{}"),
    ("max_penetration_m", "deepest penetration", "{:.4f} m"),
    ("ejections", "objects ejected", "{}"),
    ("tunnellings", "objects tunnelled", "{}"),
    ("wall_s", "wall time", "{:.1f} s"),
)

OBJECTS = 6
PROGRESS_PERIOD_S = 1.0  # simulated time between two updates of the progress bar

DESCRIPTION = """\
Run one trial: a simulated participant tidies a disorganized apartment under an assistance condition. Write to --out:
  episode.json     the disorganized house            metrics.json   the paper's metrics and the health of the physics
  events.jsonl     all events                        plan.json      all plans
  trajectory.npz   poses and actions, 25 per second  topdown.png    floor plan with planned and walked path
  recording.npz    hashes and states for replays     video.mp4      the participant's view
Equal options and seeds give equal frames and files, except for the wall time in metrics.json. Existing files are never
overwritten without --force. If a run ends early (by Ctrl-C, SIGTERM, or an error in a custom participant), the part
that was simulated is kept, and "ended" in metrics.json gives the reason.

With --live, the assistant plans in real time, as with a human participant. It proves its first plan optimal before the
clock starts. After a deviation, it shows a plan within about 50 ms and searches for a shorter one in a background
thread, while the simulation continues. The result depends on the machine, so such a run is not reproducible. But
events.jsonl and plan.json hold every plan that was shown, and `mjsim replay` shows the same plans again. There,
"improved" marks a shorter plan for the same state of the task, which does not count as a replan."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "run", run, DESCRIPTION)
    add_task_options(parser, OBJECTS)
    add_setting(parser, "user")
    add_trial_options(parser)
    add_setting(parser, "live")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="run directory to write")
    add_force(parser, "replace an earlier run at --out, but no other files")
    parser.add_argument("--no-video", action="store_true", help="do not film (about 10 times faster)")
    parser.add_argument(
        "--no-floor-plan",
        action="store_true",
        help="do not draw the floor plan; with --no-video, OpenGL is not needed",
    )
    add_frame(parser)
    add_call_limit(parser)


def run(arguments: argparse.Namespace) -> int:
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn

    from experiments.cli.terminal import error_console, progress_bars
    from experiments.session.session import Progress as SessionProgress
    from experiments.trials.trial import run_trial

    config = TrialConfig(
        assistance=arguments.assistance,
        seed=arguments.seed,
        **{
            "objects": OBJECTS,
            **given_options(arguments, ("objects", "user", "live")),
            **trial_options(arguments),
        },
    )
    film = film_config(arguments)  # raises an error for an invalid profile even if no video is recorded
    console = error_console()
    warnings: list[str] = []
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("delivered, {task.fields[clock]:.0f} s simulated in"),
        TimeElapsedColumn(),
    )
    with progress_bars(console, *columns) as bars:
        bar = bars.add_task(f"{config.assistance}, {config.user}", total=config.objects, clock=0.0)
        last = SessionProgress(-PROGRESS_PERIOD_S, 0, 0)

        def show(progress: SessionProgress) -> None:
            nonlocal last
            if progress.delivered != last.delivered or progress.time >= last.time + PROGRESS_PERIOD_S:
                last = progress
                bars.update(bar, completed=progress.delivered, clock=progress.time)

        metrics = run_trial(
            config,
            arguments.out,
            film=None if arguments.no_video else film,
            topdown=not arguments.no_floor_plan,
            replace=arguments.force,
            on_progress=show,
            on_warning=warnings.append,
        )
    _show_metrics(console, metrics, arguments.out)
    for warning in warnings:
        console.print(
            f"mjsim: {warning}; everything else is in {arguments.out}", soft_wrap=True, markup=False
        )
    if metrics["ended"] == INTERRUPTED:
        return exit_code(signal.Signals[metrics["signal"]])
    return 1 if warnings else 0


def _show_metrics(console: "Console", metrics: dict[str, Any], out: Path) -> None:
    from rich.table import Table

    table = Table(show_header=False, box=None)
    for key, label, form in SHOWN_METRICS:
        value = "unknown" if metrics[key] is None else form.format(metrics[key])
        table.add_row(label, value + (f" of {metrics['objects']}" if key == "delivered" else ""))
    console.print(table)
    if metrics["ended"] != "all delivered":
        console.print(f"ended early: {metrics['ended']}")
    names = ", ".join(sorted(p.name for p in out.iterdir()))
    console.print(f"{out}: {names}", highlight=False, soft_wrap=True)
