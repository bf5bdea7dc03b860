"""Measure how well trials at the fidelity `event` agree with the same trials at `full`."""

import os
import statistics
from collections.abc import Iterator, Sequence
from typing import Any

from benchmarks.support.agreement import TierResult, run_all_in_tiers
from experiments.trials.trial_config import TrialConfig
from mjsim.values.options import FIDELITIES

SEEDS = 50
QUICK_SEEDS = 2
OBJECTS = (6, 12, 18, 24)
QUICK_OBJECTS = (6, 24)
PARTICIPANTS = (("optimal", "follower"), ("highlight", "nearest"))
COMPARED = ("completion_time_s", "task_distance_m", "ipl_stand", "nd_feasible")
SAME_DELIVERIES, TIME_DIFFERENCE = 1.0, 0.01  # required share of equal deliveries; tolerated time difference


def measure(
    *, seeds: int = 0, objects: Sequence[int] = (), workers: int = 0, quick: bool = False
) -> dict[str, Any]:
    """Run the benchmark and return a JSON-serializable result.

    Args:
        seeds: Number of houses for each number of objects (default: 50, or 2 if `quick`).
        objects: Numbers of objects to test.
        workers: Number of processes (default: one per core).
        quick: True to run only a few trials.
    """
    count = seeds or (QUICK_SEEDS if quick else SEEDS)
    difficulties = tuple(objects) or (QUICK_OBJECTS if quick else OBJECTS)
    cells = [(participant, n) for participant in PARTICIPANTS for n in difficulties]
    configs = [
        TrialConfig(objects=n, assistance=assistance, user=user, seed=seed, regret=False)
        for (assistance, user), n in cells
        for seed in range(count)
    ]
    results = list(run_all_in_tiers(configs, workers=workers or os.cpu_count() or 1))
    rows = []
    for i, ((assistance, user), n) in enumerate(cells):
        trials = results[i * count : (i + 1) * count]
        for fidelity in FIDELITIES:
            row = compare([t["full"] for t in trials], [t[fidelity] for t in trials])
            rows.append({"assistance": assistance, "user": user, "objects": n, "fidelity": fidelity, **row})
    return {"seeds": count, "rows": rows}


def compare(full: Sequence[TierResult], tier: Sequence[TierResult]) -> dict[str, Any]:
    """Compare the results of the same trials at two fidelities.

    Mean and largest differences are relative to the mean of `full`, unless that mean is 0.
    """
    row: dict[str, Any] = {
        "same_deliveries": statistics.fmean(
            a.delivered == b.delivered for a, b in zip(full, tier, strict=True)
        ),
        "differing_seeds": [
            b.config.house_seed for a, b in zip(full, tier, strict=True) if a.delivered != b.delivered
        ],
    }
    for name in COMPARED:
        there = [float(r.metrics[name]) for r in full]
        here = [float(r.metrics[name]) for r in tier]
        mean = statistics.fmean(there)
        gaps = [b - a for a, b in zip(there, here, strict=True)]
        scale = mean if mean else 1.0
        row[name] = {
            "mean": statistics.fmean(here),
            "difference": statistics.fmean(gaps) / scale,
            "largest": max(gaps, key=abs) / scale,
        }
    return row


def lines(result: dict[str, Any]) -> Iterator[str]:
    yield f"{result['seeds']} houses of each difficulty; differences from `full`: of the mean (largest of any trial)"
    yield ""
    yield "| participant | objects | fidelity | same deliveries | time | distance | `ipl_stand` | `nd_feasible` |"
    yield "|---|---|---|---|---|---|---|---|"
    for row in result["rows"]:
        yield "| " + " | ".join(_cells(row)) + " |"
    yield ""
    for row in result["rows"]:
        if row["differing_seeds"]:
            where = f"{row['user']}, {row['objects']} objects, {row['fidelity']}"
            yield f"{where}: other deliveries with seeds {row['differing_seeds']}"
    others = [row for row in result["rows"] if row["fidelity"] != "full"]
    same = min(row["same_deliveries"] for row in others)
    worst = max(abs(row["completion_time_s"]["difference"]) for row in others)
    yield _requirement("same deliveries, worst cell", f"{same:.1%}", same >= SAME_DELIVERIES, "= 100 %")
    yield _requirement("mean completion time, worst cell", f"{worst:.2%}", worst <= TIME_DIFFERENCE, "<= 1 %")


def _cells(row: dict[str, Any]) -> Iterator[str]:
    yield from (row["user"], str(row["objects"]), row["fidelity"])
    if row["fidelity"] == "full":
        yield "-"
        yield f"{row['completion_time_s']['mean']:.1f} s"
        yield f"{row['task_distance_m']['mean']:.1f} m"
        yield f"{row['ipl_stand']['mean']:.3f}"
        yield f"{row['nd_feasible']['mean']:.3f}"
    else:
        yield f"{row['same_deliveries']:.0%}"
        for name in COMPARED:
            yield f"{row[name]['difference']:+.2%} ({row[name]['largest']:+.1%})"


def _requirement(what: str, value: str, met: bool, target: str) -> str:
    return f"{what}: {value} ({target}: {'pass' if met else 'FAIL'})"
