"""`mjsim play` from outside: how fast it answers, what a session costs, and what it does when all goes wrong."""

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.support.play_faults import measure_faults
from benchmarks.support.play_fuzz import measure_fuzz
from benchmarks.support.play_load import load, measure_crowd, measure_latency, measure_masher
from benchmarks.support.play_pages import measure_pages
from benchmarks.support.requirements import Requirement, requirement_lines

FAULTS, QUICK_FAULTS = 200, 10
MESSAGES, QUICK_MESSAGES = 10_000, 300
MESSAGES_PER_REQUEST = 10
MINUTES, QUICK_MINUTES = 60.0, 0.5
OBJECTS, QUICK_OBJECTS = 6, 1
SECONDS, QUICK_SECONDS = 20.0, 4.0
CROWD, STATE_CROWD = 3, 10  # sessions a core, with frames and with states
SEED = 13
FAST = ("--fidelity", "event")

KEYS = ("fps", "p95_ms")
REQUIREMENTS = {
    "faults": (
        Requirement("sessions whose inputs or states differ", "wrong", "<=", 0),
        Requirement("tracebacks of the server", "tracebacks", "<=", 0),
        Requirement("95th percentile of resuming with a warm worker, s", "resume_p95_s", "<", 2.0),
    ),
    "fuzz": (
        Requirement("server down", "server_down", "<=", 0),
        Requirement("tracebacks in replies", "tracebacks", "<=", 0),
        Requirement("tracebacks in the log", "tracebacks_logged", "<=", 0),
        Requirement("replies that blame the server (5xx)", "server_errors", "<=", 0),
        Requirement("others cut off", "bystander_cut_off", "<=", 0),
    ),
    "latency": (
        Requirement("95th percentile from input to frame, JPEG, ms", "jpeg_p95_ms", "<=", 120.0),
        Requirement("frames a second, JPEG", "jpeg_fps", ">=", 20.0),
        Requirement("bandwidth of JPEG over that of H.264", "codec_ratio", ">=", 5.0),
    ),
    "crowd": (
        Requirement(f"frames a second, {CROWD} sessions a core, JPEG", "jpeg_fps", ">=", 15.0),
        Requirement("95th percentile from input to frame, ms", "jpeg_p95_ms", "<=", 150.0),
        Requirement(f"states a second, {STATE_CROWD} sessions a core", "state_fps", ">=", 15.0),
        Requirement("95th percentile from input to state, ms", "state_p95_ms", "<=", 150.0),
    ),
    "pages": (
        Requirement("tasks that were not done by keys", "undone", "<=", 0),
        Requirement("tasks unlike their replay", "unlike_replay", "<=", 0),
        Requirement(
            "first frame after the click, 10 Mbit/s and 80 ms each way, s", "first_frame_s", "<=", 10.0
        ),
        Requirement("transferred until then, MB", "first_frame_mb", "<", 10.0),
    ),
    "masher": (
        Requirement("growth of a worker's memory", "worker_growth", "<=", 0.05),
        Requirement("growth of the server's memory", "server_growth", "<=", 0.05),
    ),
}


def measure(
    *,
    faults: int = 0,
    messages: int = 0,
    minutes: float = 0.0,
    objects: Sequence[int] = (),
    quick: bool = False,
) -> dict[str, Any]:
    """Run the benchmark, or only the parts whose size is given; everything in it can be written as JSON.

    Args:
        faults: How many times to disturb a session.
        messages: How many odd messages to send; a tenth as many odd requests.
        minutes: How long to press keys at random.
        objects: How many objects to put away by keys in Chromium, in every condition.
        quick: A smaller run.
    """
    whole = not (faults or messages or minutes or objects)
    if whole:
        faults, messages = (QUICK_FAULTS, QUICK_MESSAGES) if quick else (FAULTS, MESSAGES)
        minutes = QUICK_MINUTES if quick else MINUTES
        objects = (QUICK_OBJECTS if quick else OBJECTS,)
    result: dict[str, Any] = {"load": load()}
    words = FAST if quick else ()
    with tempfile.TemporaryDirectory(prefix="mjsim-play-") as name:
        folder = Path(name)
        if whole:
            found = measure_latency(_place(folder, "latency"), QUICK_SECONDS if quick else SECONDS, *words)
            result["latency"] = {"cases": found, **_ratios(found)}
            result["crowd"] = _crowds(folder, QUICK_SECONDS if quick else SECONDS, *words)
        for count in objects:
            result["pages"] = measure_pages(folder, count, *words)
        if faults:
            result["faults"] = measure_faults(_place(folder, "faults"), faults, SEED, *words)
        if messages:
            requests = -(-messages // MESSAGES_PER_REQUEST)
            result["fuzz"] = measure_fuzz(_place(folder, "fuzz"), messages, requests, SEED, *words)
        if minutes:
            found = measure_masher(_place(folder, "masher"), minutes, SEED, *words)
            worker, server = found["growth"]
            result["masher"] = {**found, "worker_growth": worker, "server_growth": server}
    return result


def lines(result: Mapping[str, Any]) -> Iterator[str]:
    """The result, for people."""
    yield f"load at the start: {result['load']:.1f} processes a core"
    for part, requirements in REQUIREMENTS.items():
        if part in result:
            yield from _details(part, result[part])
            yield from requirement_lines(result[part], requirements)


def _details(part: str, found: Mapping[str, Any]) -> Iterator[str]:
    if part == "latency":
        for name, case in found["cases"].items():
            yield (
                f"{name}: {case['fps']:.1f} fps {case['width']} px wide, input to frame {case['median_ms']:.0f} ms "
                f"(95 %: {case['p95_ms']:.0f}), "
                f"{case['kbit_s']:.0f} kbit/s, {case['memory_mb']:.0f} MB, {case['cores']:.2f} cores, "
                f"server {case['server_cores']:.2f}"
            )
    elif part == "crowd":
        for name, case in found["cases"].items():
            yield (
                f"{case['sessions']} sessions at once, {name}: {case['fps']:.1f} a second or more, "
                f"{case['width']:.0f} px wide, {case['median_ms']:.0f} ms (95 %: {case['p95_ms']:.0f}), "
                f"{case['memory_mb']:.0f} MB each"
            )
    elif part == "pages":
        for name, task in found["tasks"].items():
            yield f"{name}: " + ", ".join(f"{key} {value}" for key, value in task.items())
    elif part == "faults":
        yield f"{found['faults']} faults; seconds until the session went on, median, 95 %, longest:"
        for name, (median, most, longest) in found["resume_s"].items():
            yield f"  {name}: {median:.2f}, {most:.2f}, {longest:.2f}"
        yield from found["problems"]
    elif part == "fuzz":
        yield f"{found['messages']} odd messages, refused as {found['refusals']}"
        yield f"{found['requests']} odd requests, answered with {found['statuses']}"
        quiet, disturbed = found["bystander_p95_s"]
        yield f"acknowledgement of somebody else's input, 95 %: {quiet:.2f} s before, {disturbed:.2f} s meanwhile"
    else:
        yield f"{found['minutes']:.1f} minutes, {found['inputs']} inputs, {found['frames']} frames"
        yield f"longest wait for an acknowledgement: {found['longest_wait_s']:.2f} s"
        yield f"memory of the worker, MB: {found['worker_mb']}; of the server: {found['server_mb']}"


def _crowds(folder: Path, seconds: float, *words: str) -> dict[str, Any]:
    jpeg = measure_crowd(_place(folder, "crowd"), seconds, "jpeg", CROWD, *words)
    state = measure_crowd(_place(folder, "states"), seconds, "none", STATE_CROWD, *words)
    values = {f"{name}_{key}": case[key] for name, case in (("jpeg", jpeg), ("state", state)) for key in KEYS}
    return {"cases": {"JPEG": jpeg, "states": state}, **values}


def _ratios(found: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    jpeg = found["jpeg"]
    return {
        "jpeg_p95_ms": jpeg["p95_ms"],
        "jpeg_fps": jpeg["fps"],
        "codec_ratio": jpeg["kbit_s"] / max(found["h264"]["kbit_s"], 1e-9),
    }


def _place(folder: Path, name: str) -> Path:
    """A folder for visits, beside which the server's output has room."""
    (folder / name).mkdir()
    return folder / name / "visits"
