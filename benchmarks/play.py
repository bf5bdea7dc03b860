"""`mjsim play` from outside: how fast it answers, what a session costs, and what it does when all goes wrong."""

import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from benchmarks.support.play_faults import measure_faults
from benchmarks.support.play_fuzz import measure_fuzz
from benchmarks.support.play_load import load, measure_capacity, measure_latency
from benchmarks.support.play_pages import measure_pages
from benchmarks.support.play_server import Say
from benchmarks.support.play_soak import measure_soak
from benchmarks.support.requirements import Requirement, requirement_lines
from experiments.errors import ConfigError

SESSIONS, STATE_SESSIONS = 3, 10  # a core, with frames and with states
MESSAGES_PER_REQUEST = 10
SEED = 13
FAST = ("--fidelity", "event")


@dataclass(frozen=True)
class Size:
    """How much of everything is measured.

    Attributes:
        seconds: Of each case of latency and capacity.
        faults: Sessions are disturbed so many times.
        messages: Odd messages; a tenth as many odd requests.
        minutes: Of keys pressed at random.
        objects: Put away by keys in each condition.
        conditions: In which that is done.
        tries: Numbers of sessions that are tried, each smaller than the one before.
        tier: Words of the server's command line that choose the fidelity.
    """

    seconds: float = 15.0
    faults: int = 40
    messages: int = 2000
    minutes: float = 1.0
    objects: int = 1
    conditions: tuple[str, ...] = ("none", "highlight", "optimal")
    tries: int = 3
    tier: tuple[str, ...] = ()


QUICK = Size(seconds=4.0, faults=7, messages=200, minutes=0.1, conditions=("optimal",), tries=1, tier=FAST)


@dataclass(frozen=True)
class Part:
    """A part of the benchmark.

    Attributes:
        measure: Takes a folder that is there, how much is measured, and who is told of it.
        requirements: Of its result.
        details: Its result in words.
    """

    measure: Callable[[Path, Size, Say], dict[str, Any]]
    requirements: Sequence[Requirement]
    details: Callable[[Mapping[str, Any]], Iterator[str]]


def measure(
    *,
    parts: Sequence[str] = (),
    faults: int = 0,
    messages: int = 0,
    minutes: float = 0.0,
    objects: Sequence[int] = (),
    quick: bool = False,
) -> dict[str, Any]:
    """Run the benchmark, or only some parts; everything in the result can be written as JSON.

    Args:
        parts: Names of the parts to run; none for those whose size is given, or else all.
        faults: How many times to disturb a session.
        messages: How many odd messages to send; a tenth as many odd requests.
        minutes: How long to press keys at random.
        objects: How many objects to put away by keys in Chromium, in every condition.
        quick: A smaller run, in the quickest tier.

    Raises:
        ConfigError: There is no such part.
    """
    for name in parts:
        if name not in PARTS:
            raise ConfigError(f"benchmark play has no part {name!r}; there are {', '.join(PARTS)}")
    given: dict[str, Any] = {
        "faults": faults,
        "messages": messages,
        "minutes": minutes,
        "objects": max(objects, default=0),
    }
    given = {name: value for name, value in given.items() if value}
    size = replace(QUICK if quick else Size(), **given)
    sized = {"faults": "faults", "messages": "fuzz", "minutes": "soak", "objects": "pages"}
    chosen: Sequence[str] = parts or [sized[name] for name in given] or tuple(PARTS)
    result: dict[str, Any] = {"load": load()}
    with tempfile.TemporaryDirectory(prefix="mjsim-play-") as folder:
        for name in chosen:
            place = Path(folder) / name
            place.mkdir()
            result[name] = PARTS[name].measure(place, size, _progress(name))
    return result


def lines(result: Mapping[str, Any]) -> Iterator[str]:
    """The result, for people."""
    yield f"load at the start: {result['load']:.1f} processes a core"
    for name, part in PARTS.items():
        if name in result:
            yield from part.details(result[name])
            yield from requirement_lines(result[name], part.requirements)


def _progress(part: str) -> Say:
    """Says on standard error what is under way, and for how long the part has been."""
    began = time.monotonic()

    def say(line: str) -> None:
        print(f"{part}, {time.monotonic() - began:.0f} s: {line}", file=sys.stderr, flush=True)

    say("begins")
    return say


def _latency(folder: Path, size: Size, say: Say) -> dict[str, Any]:
    found = measure_latency(folder / "visits", size.seconds, say, *size.tier)
    jpeg = found["jpeg"]
    ratio = jpeg["kbit_s"] / max(found["h264"]["kbit_s"], 1e-9)
    return {"cases": found, "jpeg_p95_ms": jpeg["p95_ms"], "jpeg_fps": jpeg["fps"], "codec_ratio": ratio}


def _latency_details(found: Mapping[str, Any]) -> Iterator[str]:
    for name, case in found["cases"].items():
        yield (
            f"{name}: {case['fps']:.1f} fps {case['width']} px wide, input to frame {case['median_ms']:.0f} ms "
            f"(95 %: {case['p95_ms']:.0f}), {case['kbit_s']:.0f} kbit/s, {case['memory_mb']:.0f} MB, "
            f"{case['cores']:.2f} cores, server {case['server_cores']:.2f}"
        )


def _capacity(folder: Path, size: Size, say: Say) -> dict[str, Any]:
    cores = os.cpu_count() or 1
    found = []
    for codec, most in (("jpeg", SESSIONS * cores), ("none", STATE_SESSIONS * cores)):
        counts = range(most, 0, -max(1, most // 6))[: size.tries]
        found.append(measure_capacity(folder, size.seconds, codec, counts, say, *size.tier))
    frames, states = found
    return {
        "cases": {"JPEG": frames["tried"], "states": states["tried"]},
        "frame_sessions": frames["a_core"],
        "state_sessions": states["a_core"],
    }


def _capacity_details(found: Mapping[str, Any]) -> Iterator[str]:
    for name, tried in found["cases"].items():
        for case in tried:
            yield (
                f"{case['sessions']} sessions at once, {name}: {case['fps']:.1f} a second or more, "
                f"{case['width']:.0f} px wide, {case['median_ms']:.0f} ms (95 %: {case['p95_ms']:.0f}), "
                f"{case['memory_mb']:.0f} MB and {case['cores']:.2f} cores each, server {case['server_cores']:.2f}, "
                f"simulated browsers {case['browser_cores']:.2f}"
            )


def _pages(folder: Path, size: Size, say: Say) -> dict[str, Any]:
    return measure_pages(folder, size.objects, size.conditions, say, *size.tier)


def _pages_details(found: Mapping[str, Any]) -> Iterator[str]:
    for name, task in found["tasks"].items():
        yield f"{name}: " + ", ".join(f"{key} {value}" for key, value in task.items())


def _faults(folder: Path, size: Size, say: Say) -> dict[str, Any]:
    return measure_faults(folder / "visits", size.faults, SEED, say, *size.tier)


def _faults_details(found: Mapping[str, Any]) -> Iterator[str]:
    yield f"{found['faults']} faults; seconds until the session went on, median, 95 %, longest:"
    for name, (median, most, longest) in found["resume_s"].items():
        yield f"  {name}: {median:.2f}, {most:.2f}, {longest:.2f}"
    yield from found["problems"]


def _fuzz(folder: Path, size: Size, say: Say) -> dict[str, Any]:
    requests = -(-size.messages // MESSAGES_PER_REQUEST)
    say(f"{size.messages} odd messages, {requests} odd requests")
    return measure_fuzz(folder / "visits", size.messages, requests, SEED, *size.tier)


def _fuzz_details(found: Mapping[str, Any]) -> Iterator[str]:
    yield f"{found['messages']} odd messages, refused as {found['refusals']}"
    yield f"{found['requests']} odd requests, answered with {found['statuses']}"
    quiet, disturbed = found["bystander_p95_s"]
    yield f"acknowledgement of somebody else's input, 95 %: {quiet:.2f} s before, {disturbed:.2f} s meanwhile"


def _soak(folder: Path, size: Size, say: Say) -> dict[str, Any]:
    return measure_soak(folder / "visits", size.minutes, SEED, say, *size.tier)


def _soak_details(found: Mapping[str, Any]) -> Iterator[str]:
    yield (
        f"{found['minutes']:.1f} minutes, {found['inputs']} inputs, {found['sessions']} sessions, "
        f"{found['visits']} short visits beside them"
    )
    yield f"longest wait for an acknowledgement: {found['longest_wait_s']:.2f} s"
    yield f"memory of the worker, MB: {found['worker_mb']}; of the server: {found['server_mb']}"


PARTS = {
    "latency": Part(
        _latency,
        (
            Requirement("95th percentile from input to frame, JPEG, ms", "jpeg_p95_ms", "<=", 120.0),
            Requirement("frames a second, JPEG", "jpeg_fps", ">=", 20.0),
            Requirement("bandwidth of JPEG over that of H.264", "codec_ratio", ">=", 5.0),
        ),
        _latency_details,
    ),
    "capacity": Part(
        _capacity,
        (
            Requirement(
                "sessions a core that hold 15 fps and 150 ms, JPEG", "frame_sessions", ">=", SESSIONS
            ),
            Requirement(
                "sessions a core that hold 15 states a second and 150 ms",
                "state_sessions",
                ">=",
                STATE_SESSIONS,
            ),
        ),
        _capacity_details,
    ),
    "pages": Part(
        _pages,
        (
            Requirement("tasks that were not done by keys", "undone", "<=", 0),
            Requirement("tasks unlike their replay", "unlike_replay", "<=", 0),
            Requirement(
                "first frame after the click, 10 Mbit/s and 80 ms each way, s", "first_frame_s", "<=", 10.0
            ),
            Requirement("transferred until then, MB", "first_frame_mb", "<", 10.0),
        ),
        _pages_details,
    ),
    "faults": Part(
        _faults,
        (
            Requirement("sessions whose inputs or states differ", "wrong", "<=", 0),
            Requirement("tracebacks of the server", "tracebacks", "<=", 0),
            Requirement(
                "95th percentile of resuming, unless all processes died, s", "resume_p95_s", "<", 2.0
            ),
        ),
        _faults_details,
    ),
    "fuzz": Part(
        _fuzz,
        (
            Requirement("server down", "server_down", "<=", 0),
            Requirement("tracebacks in replies", "tracebacks", "<=", 0),
            Requirement("tracebacks in the log", "tracebacks_logged", "<=", 0),
            Requirement("replies that blame the server (5xx)", "server_errors", "<=", 0),
            Requirement("others cut off", "bystander_cut_off", "<=", 0),
        ),
        _fuzz_details,
    ),
    "soak": Part(
        _soak,
        (
            Requirement("growth of a worker's memory", "worker_growth", "<=", 0.05),
            Requirement("growth of the server's memory", "server_growth", "<=", 0.05),
            Requirement("longest wait for an acknowledgement, s", "longest_wait_s", "<=", 2.0),
        ),
        _soak_details,
    ),
}
