"""Measure the speed of whole trials, as run by `mjsim batch`, and the share of time spent in each part.

Each participant model runs one batch in one process. The speed is the simulated time of its trials divided by
their wall-clock time. A second run measures the share of each part of the program. It also repeats the
recorded calls on a world without a participant, as a reference for the speed of the machine.
"""

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.support.requirements import outcome
from experiments.trials.batch import run_batch
from experiments.trials.design import factorial
from experiments.trials.warmup import compile_kernels

OBJECTS = 24
SEEDS = 10
QUICK_SEEDS = 2
HOUSE_WANTED = 0.5  # largest permitted time for `House.load`, in seconds
WORKER = Path(__file__).with_name("_trials_worker.py")


class Setting(NamedTuple):
    """The settings of a batch, and its required speed in simulated seconds per second."""

    fidelity: str
    assistance: str
    user: str
    wanted: float


SETTINGS = (
    Setting("event", "optimal", "follower", 600.0),
    Setting("event", "highlight", "nearest", 400.0),
    Setting("event", "none", "searcher", 250.0),
    Setting("full", "optimal", "follower", 115.0),
    Setting("full", "none", "searcher", 90.0),
)


def measure(*, seeds: int = 0, quick: bool = False) -> dict[str, Any]:
    """Run the benchmark and return a JSON-serializable result.

    Args:
        seeds: Number of houses (default: 10, or 2 if `quick`).
        quick: True to run only a few houses.
    """
    compile_kernels()
    count = seeds or (QUICK_SEEDS if quick else SEEDS)
    return {"seeds": count, "objects": OBJECTS, "rows": [measure_batch(s, count) for s in SETTINGS]}


def measure_batch(setting: Setting, seeds: int, objects: int = OBJECTS) -> dict[str, Any]:
    """Measure the speed of a batch, a reference speed, and the share of each part of the program."""
    design = factorial(
        objects=(objects,),
        assistance=(setting.assistance,),
        users=(setting.user,),
        seeds=range(seeds),
        fidelity=setting.fidelity,
        regret=False,
    )
    with tempfile.TemporaryDirectory() as folder:
        started = time.perf_counter()
        trials = run_batch(design, Path(folder) / "batch", workers=1)
        elapsed = time.perf_counter() - started
    if len(trials) < seeds:
        raise RuntimeError(f"{seeds - len(trials)} of {seeds} trials failed: {setting}")
    simulated = sum(t["simulated_s"] for t in trials)
    wall = sum(t["wall_s"] for t in trials)
    command = [sys.executable, "-P", str(WORKER), json.dumps([*setting[:3], objects, seeds])]
    timed = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)
    total = sum(timed["parts"].values())
    parts = {name: seconds / total * wall / elapsed for name, seconds in timed["parts"].items()}
    speed, bare = simulated / wall, simulated / timed["bare_s"]
    return {
        **setting._asdict(),
        "simulated_s": simulated,
        "wall_s": wall,
        "simulated_per_s": speed,
        "bare_simulated_per_s": bare,
        "share_of_bare": speed / bare,
        "house_s": timed["house_s"],
        "shares": {"start-up": 1.0 - wall / elapsed, **parts},
    }


def lines(result: dict[str, Any]) -> Iterator[str]:
    rows = result["rows"]
    yield f"{result['objects']} objects, {result['seeds']} houses, one process, no regrets; simulated s per s"
    yield ""
    parts = list(rows[0]["shares"])
    yield (
        "| fidelity | participant | trials | the same calls on a bare world | ratio | "
        + " | ".join(parts)
        + " |"
    )
    yield "|---" * (5 + len(parts)) + "|"
    for row in rows:
        shares = " | ".join(f"{row['shares'][part]:.0%}" for part in parts)
        yield (
            f"| {row['fidelity']} | {row['user']} | {row['simulated_per_s']:.0f} | {row['bare_simulated_per_s']:.0f} | "
            f"{row['share_of_bare']:.3f} | {shares} |"
        )
    yield ""
    for row in rows:
        what = f"{row['fidelity']}, {row['user']}"
        yield _requirement(what, row["simulated_per_s"], row["wanted"], ">=", " simulated s per s")
    worst = max(row["house_s"] for row in rows)
    yield _requirement("house loaded in a new process, slowest", worst, HOUSE_WANTED, "<=", " s")


def _requirement(what: str, value: float, wanted: float, sign: str, unit: str) -> str:
    return f"{what}: {value:.4g}{unit} ({sign} {wanted:g}: {outcome(value, sign, wanted)})"
