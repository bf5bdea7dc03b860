"""Simulate one hour of running at 1 to 8 m/s into walls, corners, furniture and heaps of objects."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from benchmarks.support.parallel_sessions import run_sessions
from benchmarks.support.requirements import Requirement, requirement_lines
from benchmarks.support.walking_sessions import SECONDS, WalkResult, run_session

HOURS, QUICK = 1.0, 0.05
SLOW = 2.0  # largest speed in m/s of the sessions that are also reported separately
REQUIREMENTS = (
    Requirement(
        "control steps at which the body was in or had crossed something solid", "tunnelled", "<=", 0
    ),
    Requirement("retreats in which the body got no farther than 0.2 m in 2 s", "stuck", "<=", 0),
    Requirement("drift while standing, at most, mm in 1 s", "drift_max_mm", "<=", 1.0),
    Requirement("turning while standing, at most, degrees in 1 s", "turn_max_deg", "<=", 0.1),
    Requirement("steps that are not finite, or MuJoCo warnings", "errors", "<=", 0),
    Requirement("objects that tunnelled", "object_tunnellings", "<=", 0),
    Requirement("objects ejected", "ejections", "<=", 0),
    Requirement("objects outside the house at the end", "lost", "<=", 0),
)


def measure(
    quick: bool = False, hours: float | None = None, workers: int | None = None, only: int | None = None
) -> dict[str, Any]:
    """Run the benchmark and return a JSON-serializable result.

    Args:
        quick: True to run only a few simulated minutes.
        hours: Simulated time in hours.
        workers: Number of processes (default: one per core).
        only: Number of a single session to run, in order to reproduce a failure.
    """
    total = math.ceil(3600.0 * (hours or (QUICK if quick else HOURS)) / SECONDS)
    return summarise(run_sessions(run_session, total, workers=workers, only=only))


def summarise(walks: Sequence[WalkResult]) -> dict[str, Any]:
    overlap = 1e3 * np.concatenate([walk.overlap for walk in walks])
    slow = 1e3 * np.concatenate([[0.0], *(walk.overlap for walk in walks if walk.speed <= SLOW)])
    return {
        "benchmark": "walking",
        "simulated_s": sum(walk.simulated for walk in walks),
        "sessions": len(walks),
        "retreats": sum(walk.retreats for walk in walks),
        "tunnelled": sum(walk.tunnelled for walk in walks),
        "stuck": sum(walk.stuck for walk in walks),
        "drift_max_mm": 1e3 * max(max(walk.drift, default=0.0) for walk in walks),
        "turn_max_deg": math.degrees(max(max(walk.turned, default=0.0) for walk in walks)),
        "errors": sum(walk.error is not None for walk in walks),
        "ejections": sum(walk.ejections for walk in walks),
        "object_tunnellings": sum(walk.object_tunnellings for walk in walks),
        "lost": sum(walk.lost for walk in walks),
        "fastest_object": max(walk.fastest for walk in walks),
        "overlap_p99_mm": float(np.percentile(overlap, 99)),
        "overlap_max_mm": float(overlap.max()),
        "overlap_slow_p99_mm": float(np.percentile(slow, 99)),
        "overlap_slow_max_mm": float(slow.max()),
        "failures": [
            {"session": walk.session, "speed": walk.speed, "stuck": walk.stuck, "tunnelled": walk.tunnelled}
            for walk in walks
            if walk.tunnelled
            or walk.stuck
            or walk.error
            or walk.lost
            or max(walk.drift, default=0.0) > 1e-3
            or walk.ejections
            or walk.object_tunnellings
        ],
    }


def lines(result: dict[str, Any]) -> Iterator[str]:
    for failure in result["failures"]:
        yield "failed: at {speed:.1f} m/s; --only {session} runs it again".format(**failure)
    yield (
        f"{result['simulated_s']:.0f} simulated s in {result['sessions']} sessions, {result['retreats']} retreats; "
        f"fastest object {result['fastest_object']:.1f} m/s, {result['ejections']} ejected"
    )
    yield (
        f"overlap of body and house, 99th percentile and maximum: {result['overlap_p99_mm']:.1f} and "
        f"{result['overlap_max_mm']:.1f} mm; up to {SLOW:g} m/s {result['overlap_slow_p99_mm']:.1f} and "
        f"{result['overlap_slow_max_mm']:.1f} mm"
    )
    yield from requirement_lines(result, REQUIREMENTS)
