"""`mjsim run`: one trial, filmed."""

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
PROGRESS_PERIOD = 1.0  # s of simulated time between updates of the progress bar

DESCRIPTION = """\
Run one trial: a simulated person tidies a disorganized apartment under an assistance condition. Writes to --out
  episode.json     the disorganized house            metrics.json   the paper's metrics and the health of the physics
  events.jsonl     everything that happened          plan.json      every plan that was made
  trajectory.npz   poses and actions, 25 per second  topdown.png    floor plan with planned and walked path
  recording.npz    hashes and states for replays     video.mp4      what the person saw
Equal options and seeds give equal frames and files, except for the wall time in metrics.json.
Files at --out are not touched. However a run ends (Ctrl-C, SIGTERM, an error in a participant of your own),
what was simulated until then is kept there, and "ended" in metrics.json says how.

With --live the assistant plans in real time, as with a human participant. Before the clock starts it plans the task
and proves the plan optimal. After a deviation it shows a plan within about 50 ms and keeps looking for a shorter one in
a background thread; no control step waits for that. The result depends on the machine, so such a run is not
reproducible. events.jsonl and plan.json hold every plan that was shown ("improved" marks a shorter plan for the same
task, which is no replan), and `mjsim replay` shows the same plans again."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "run", run, description=DESCRIPTION)
    add_task_options(parser, OBJECTS)
    add_setting(parser, "user")
    add_trial_options(parser)
    add_setting(parser, "live")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="run directory to write")
    add_force(parser, "replace an earlier run at --out, and nothing else")
    parser.add_argument("--no-video", action="store_true", help="do not film; about 10 times faster")
    parser.add_argument(
        "--no-floor-plan", action="store_true", help="draw no floor plan; without video, no OpenGL is needed"
    )
    add_frame(parser)
    add_call_limit(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the trial, show progress, then the metrics."""
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
    film = film_config(arguments)  # refuses a profile that there is not, even where nothing is filmed
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
        last = SessionProgress(-PROGRESS_PERIOD, 0, 0)

        def show(progress: SessionProgress) -> None:
            nonlocal last
            if progress.delivered != last.delivered or progress.time >= last.time + PROGRESS_PERIOD:
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
        console.print(f"mjsim: {warning}; all else is in {arguments.out}", soft_wrap=True, markup=False)
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
