"""Measure how often placements by hand succeed or cause physics errors, over 10,000 placements."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from benchmarks.support.parallel_sessions import run_sessions
from benchmarks.support.placement_sessions import LEVELS, NOT_TRIED, Placement, run_session
from benchmarks.support.requirements import Requirement, requirement_lines

COUNT, QUICK = 10_000, 300
REQUIREMENTS = (
    Requirement("delivered at the first try, %", "delivered_percent", ">=", 99.9),
    Requirement("steps that are not finite, or MuJoCo warnings", "errors", "<=", 0),
    Requirement("ejections", "ejections", "<=", 0),
    Requirement("tunnellings", "tunnellings", "<=", 0),
    Requirement("penetration, 99th percentile of control steps, mm", "penetration_p99_mm", "<", 2.0),
    Requirement("penetration, 99th percentile of placements' deepest, mm", "deepest_p99_mm", "<", 2.0),
    Requirement("penetration, maximum, mm", "penetration_max_mm", "<", 10.0),
)


def measure(
    quick: bool = False, count: int | None = None, workers: int | None = None, only: int | None = None
) -> dict[str, Any]:
    """Run the benchmark and return a JSON-serializable result.

    Args:
        quick: True to run only a few hundred placements.
        count: Number of placements, rounded up to whole sessions.
        workers: Number of processes (default: one per core).
        only: Number of a single session to run, in order to reproduce a failure.
    """
    total = count or (QUICK if quick else COUNT)
    sessions = run_sessions(run_session, math.ceil(total / LEVELS), workers=workers, only=only)
    return summarise([placement for session in sessions for placement in session])


def summarise(placements: Sequence[Placement]) -> dict[str, Any]:
    tried = [p for p in placements if p.outcome not in NOT_TRIED]
    steps = 1e3 * np.concatenate([p.penetration for p in tried])
    deepest = 1e3 * np.array([p.penetration.max(initial=0.0) for p in tried])
    settle = np.array([p.settle_s for p in tried if p.outcome == "placed"])
    return {
        "benchmark": "placements",
        "placements": len(tried),
        "not_tried": {name: sum(p.outcome == name for p in placements) for name in NOT_TRIED},
        "delivered_percent": 100.0 * sum(p.outcome == "placed" for p in tried) / len(tried),
        "errors": sum(p.outcome == "error" for p in placements),
        "ejections": sum(p.ejections for p in placements),
        "tunnellings": sum(p.tunnellings for p in placements),
        "penetration_p99_mm": float(np.percentile(steps, 99)),
        "penetration_max_mm": float(steps.max()),
        "deepest_p99_mm": float(np.percentile(deepest, 99)),
        "settle_mean_s": float(settle.mean()),
        "settle_p99_s": float(np.percentile(settle, 99)),
        "settle_max_s": float(settle.max()),
        "weld_error_max_mm": 1e3 * max(p.weld_m for p in tried),
        "weld_error_max_deg": math.degrees(max(p.weld_rad for p in tried)),
        "by_receptacle": _rows(tried, lambda p: p.receptacle),
        "by_fill": _rows(tried, lambda p: str(p.fill)),
        "by_model": _rows(tried, lambda p: p.model),
        "failures": [
            {"session": p.session, "model": p.model, "fill": p.fill, "outcome": p.outcome}
            for p in placements
            if p.outcome != "placed" or p.ejections or p.tunnellings
        ],
    }


def _rows(placements: Sequence[Placement], key: Callable[[Placement], str]) -> list[dict[str, Any]]:
    rows = []
    for value in sorted({key(p) for p in placements}):
        mine = [p for p in placements if key(p) == value]
        rows.append(
            {
                "name": value,
                "placements": len(mine),
                "delivered": sum(p.outcome == "placed" for p in mine),
                "deepest_mm": 1e3 * max(float(p.penetration.max(initial=0.0)) for p in mine),
                "settle_max_s": max(p.settle_s for p in mine),
            }
        )
    return rows


def lines(result: dict[str, Any]) -> Iterator[str]:
    for title, key in (
        ("receptacle", "by_receptacle"),
        ("objects in it before", "by_fill"),
        ("object", "by_model"),
    ):
        yield f"{title:22}{'placements':>12}{'delivered':>11}{'deepest mm':>12}{'settle s':>10}"
        for row in result[key]:
            yield (
                f"{row['name']:22}{row['placements']:12}{row['delivered']:11}{row['deepest_mm']:12.2f}"
                f"{row['settle_max_s']:10.2f}"
            )
    for failure in result["failures"]:
        yield "failed: {outcome} of {model} with {fill} before it; --only {session} runs it again".format(
            **failure
        )
    yield (
        f"{result['placements']} placements; settled within {result['settle_mean_s']:.2f} s on average, "
        f"{result['settle_p99_s']:.2f} s in 99 %, {result['settle_max_s']:.2f} s at most; weld error at most "
        f"{result['weld_error_max_mm']:.2f} mm and {result['weld_error_max_deg']:.1f} degrees"
    )
    yield from requirement_lines(result, REQUIREMENTS)
