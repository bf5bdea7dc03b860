"""Measure weld errors and lost objects while two objects are carried through the house at 1.4 m/s."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from benchmarks.support.carrying_sessions import CarryResult, run_session
from benchmarks.support.parallel_sessions import run_sessions
from benchmarks.support.requirements import Requirement, requirement_lines

COUNT, QUICK = 200, 20
STRAIGHT, CORNER = (1.35, 0.2), (1.2, 1.0)  # thresholds for the speed in m/s and the turning speed in rad/s
REQUIREMENTS = (
    Requirement("objects that arrive, %", "kept_percent", ">=", 99.0),
    Requirement("weld error, 99th percentile at 1.4 m/s, straight on, mm", "straight_p99_mm", "<", 2.0),
    Requirement("weld error, 99th percentile at 1.4 m/s, round corners, mm", "corner_p99_mm", "<", 2.0),
    Requirement("weld error, 99th percentile at 1.4 m/s, round corners, degrees", "corner_p99_deg", "<", 5.0),
    Requirement("weld error, maximum at 1.4 m/s, straight on, mm", "straight_max_mm", "<", 2.0),
    Requirement("weld error, maximum at 1.4 m/s, round corners, mm", "corner_max_mm", "<", 2.0),
    Requirement("weld error, maximum at 1.4 m/s, straight on, degrees", "straight_max_deg", "<", 5.0),
    Requirement("weld error, maximum at 1.4 m/s, round corners, degrees", "corner_max_deg", "<", 5.0),
)


def measure(
    quick: bool = False, count: int | None = None, workers: int | None = None, only: int | None = None
) -> dict[str, Any]:
    """Run the benchmark and return a JSON-serializable result.

    Args:
        quick: True to run only a few walks.
        count: Number of walks.
        workers: Number of processes (default: one per core).
        only: Number of a single session to run, in order to reproduce a failure.
    """
    sessions = count or (QUICK if quick else COUNT)
    return summarise(run_sessions(run_session, sessions, workers=workers, only=only))


def summarise(walks: Sequence[CarryResult]) -> dict[str, Any]:
    speed = np.concatenate([walk.speed for walk in walks])
    turn = np.abs(np.concatenate([walk.turn for walk in walks]))
    everywhere = {
        "straight": (speed > STRAIGHT[0]) & (turn < STRAIGHT[1]),
        "corner": (speed > CORNER[0]) & (turn > CORNER[1]),
        "all": np.ones(len(speed), bool),
    }
    result: dict[str, Any] = {
        "benchmark": "carrying",
        "walks": len(walks),
        "metres": sum(walk.length for walk in walks),
        "arrived": sum(walk.arrived for walk in walks),
        "lost": sum(walk.lost for walk in walks),
        "kept_percent": 100.0 * (1.0 - sum(walk.lost for walk in walks) / (2 * len(walks))),
        "penetration_max_mm": 1e3 * max(float(walk.penetration.max()) for walk in walks),
    }
    for unit, errors in (
        ("mm", 1e3 * np.concatenate([walk.stretch for walk in walks])),
        ("deg", np.degrees(np.concatenate([walk.twist for walk in walks]))),
    ):
        for name, where in everywhere.items():
            values = errors[where]
            values = values[~np.isnan(values)]
            result[f"{name}_p99_{unit}"] = float(np.percentile(values, 99)) if values.size else 0.0
            result[f"{name}_max_{unit}"] = float(values.max(initial=0.0))
    return result


def lines(result: dict[str, Any]) -> Iterator[str]:
    yield (
        f"{result['walks']} walks with two objects each, {result['metres']:.0f} m; {result['arrived']} arrived, "
        f"{result['lost']} objects lost; deepest overlap {result['penetration_max_mm']:.1f} mm"
    )
    yield f"{'weld error':12}{'p99 mm':>9}{'max mm':>9}{'p99 deg':>9}{'max deg':>9}"
    for name in ("straight", "corner", "all"):
        figures = [result[f"{name}_{kind}_{unit}"] for unit in ("mm", "deg") for kind in ("p99", "max")]
        yield f"{name:12}" + "".join(f"{figure:9.2f}" for figure in figures)
    yield from requirement_lines(result, REQUIREMENTS)
