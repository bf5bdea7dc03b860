"""Measure the response times of `mjsim play` over real sockets, and the number of sessions per core."""

import os
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.support.first_frame import measure_first_frame
from benchmarks.support.play_load import load, measure_capacity, measure_latency
from benchmarks.support.play_server import ProgressReport
from benchmarks.support.requirements import Requirement, requirement_lines
from experiments.errors import ConfigError

SESSIONS, DRAWING_SESSIONS = 3, 25  # required sessions per core, with frames and with drawing clients
SECONDS, QUICK_SECONDS = 15.0, 4.0  # duration of each case in seconds
OPENINGS, QUICK_OPENINGS = 5, 1  # number of times that a link is opened in each case
TRIES = 3  # how many different numbers of sessions are tried, in descending order
FAST = ("--fidelity", "event")
REQUIREMENTS = {
    "latency": (
        Requirement("95th percentile from input to frame, JPEG, ms", "jpeg_p95_ms", "<=", 120.0),
        Requirement("frames a second, JPEG", "jpeg_fps", ">=", 20.0),
        Requirement("bandwidth of JPEG over that of H.264", "codec_ratio", ">=", 5.0),
    ),
    "capacity": (
        Requirement("sessions a core that hold 15 fps and 150 ms, JPEG", "frames", ">=", SESSIONS),
        Requirement(
            "sessions a core that draw, with 25 states a second and 95 % of inputs acknowledged in 60 ms",
            "states",
            ">=",
            DRAWING_SESSIONS,
        ),
        Requirement("bandwidth of each of them, kbit/s", "states_kbit_s", "<=", 100.0),
        Requirement("memory of the server for each of them, MB", "states_memory_mb", "<=", 80.0),
    ),
    "first-frame": (
        Requirement("from the link to Start, first visit, s", "first_s", "<=", 3.0),
        Requirement("the same at 10 Mbit/s and 80 ms, s", "slow_s", "<=", 5.0),
        Requirement("second visit, s", "second_s", "<=", 1.0),
        Requirement("over the network, first visit, MB", "megabytes", "<=", 2.0),
    ),
}


def measure(*, parts: Sequence[str] = (), quick: bool = False) -> dict[str, Any]:
    """Run all or some parts of the benchmark and return a JSON-serializable result.

    Args:
        parts: Names of the parts to run (all by default).
        quick: True to run a smaller benchmark at the fastest fidelity.

    Raises:
        ConfigError: There is no such part.
    """
    for name in parts:
        if name not in REQUIREMENTS:
            raise ConfigError(f"benchmark play has no part {name!r}; there are {', '.join(REQUIREMENTS)}")
    result: dict[str, Any] = {"load": load()}
    measures = {
        "latency": _latency,
        "capacity": _capacity,
        "first-frame": _first_frame,
    }
    with tempfile.TemporaryDirectory(prefix="mjsim-play-") as folder:
        for name in parts or measures:
            work = Path(folder) / name
            work.mkdir()
            result[name] = measures[name](work, _progress(name), quick)
    return result


def lines(result: Mapping[str, Any]) -> Iterator[str]:
    yield f"load at the start: {result['load']:.1f} processes a core"
    for name, requirements in REQUIREMENTS.items():
        if name in result:
            line = LINES.get(name, _line)
            yield from (line(case_name, case) for case_name, case in result[name]["cases"].items())
            yield from requirement_lines(result[name], requirements)


def _line(name: str, case: Mapping[str, Any]) -> str:
    return (
        f"{name}: {case['fps']:.1f} fps or more, {case['width']:.0f} px wide, input to frame "
        f"{case['median_ms']:.0f} ms (95 %: {case['p95_ms']:.0f}), {case['kbit_s']:.0f} kbit/s, "
        f"{case['memory_mb']:.0f} MB and {case['cores']:.2f} cores each, server {case['server_cores']:.2f}"
    )


def _first_frame_line(name: str, case: Mapping[str, Any]) -> str:
    return (
        f"{name}: {case['seconds']:.2f} s from the link to Start (slowest of {case['tries']}: "
        f"{case['slowest']:.2f} s), {case['megabytes']:.2f} MB"
    )


LINES = {"first-frame": _first_frame_line}


def _progress(part: str) -> ProgressReport:
    """Return a function that prints progress messages with the elapsed time to standard error."""
    began = time.monotonic()

    def report(line: str) -> None:
        print(f"{part}, {time.monotonic() - began:.0f} s: {line}", file=sys.stderr, flush=True)

    return report


def _latency(folder: Path, report: ProgressReport, quick: bool) -> dict[str, Any]:
    seconds, words = _size(quick)
    found = measure_latency(folder / "visits", seconds, report, *words)
    jpeg = found["jpeg"]
    ratio = jpeg["kbit_s"] / max(found["h264"]["kbit_s"], 1e-9)
    return {"cases": found, "jpeg_p95_ms": jpeg["p95_ms"], "jpeg_fps": jpeg["fps"], "codec_ratio": ratio}


def _capacity(folder: Path, report: ProgressReport, quick: bool) -> dict[str, Any]:
    seconds, words = _size(quick)
    cores = os.cpu_count() or 1
    frames = measure_capacity(folder, seconds, "jpeg", _counts(SESSIONS * cores, quick), report, *words)
    # The server gets only one core because the simulated browsers need the others.
    drawing = _counts(DRAWING_SESSIONS, quick)
    states = measure_capacity(folder, seconds, "none", drawing, report, *words, core=cores - 1)
    cases = {f"{case['sessions']:.0f} sessions, frames": case for case in frames}
    cases |= {f"{case['sessions']:.0f} sessions that draw, a core": case for case in states}
    return {
        "cases": cases,
        "frames": _held(frames) / cores,
        "states": _held(states),
        "states_kbit_s": states[-1]["kbit_s"],
        "states_memory_mb": states[-1]["memory_mb"],
    }


def _counts(most: int, quick: bool) -> Sequence[int]:
    return range(most, 0, -max(1, most // 6))[: 1 if quick else TRIES]


def _held(tried: Sequence[Mapping[str, float]]) -> float:
    """Return the number of sessions in the last attempt, or 0 if it did not meet the requirements."""
    return tried[-1]["sessions"] if tried[-1]["holds"] else 0.0


def _first_frame(folder: Path, report: ProgressReport, quick: bool) -> dict[str, Any]:
    _, words = _size(quick)
    cases = measure_first_frame(folder / "visits", QUICK_OPENINGS if quick else OPENINGS, report, *words)
    first = cases["first visit"]
    return {
        "cases": cases,
        "first_s": first["seconds"],
        "slow_s": cases["first visit, 10 Mbit/s and 80 ms"]["seconds"],
        "second_s": cases["second visit"]["seconds"],
        "megabytes": first["megabytes"],
    }


def _size(quick: bool) -> tuple[float, tuple[str, ...]]:
    return (QUICK_SECONDS, FAST) if quick else (SECONDS, ())
