"""Runs and batches that are killed at seeded moments and begun again: are their files those of undisturbed ones?"""

import json
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track

from benchmarks.support.kills import (
    BATCH,
    RUN,
    SIGNALS,
    Command,
    differences,
    finish,
    kill,
    leftovers,
    start,
)
from benchmarks.support.requirements import Requirement, requirement_lines
from experiments.errors import ExperimentError
from experiments.replaying.replay import replay
from experiments.runs import records

KILLS, QUICK_KILLS = 200, 8
KILLS_IN_A_ROW = 4  # of a case: before its command is left to finish
TRIES = 3 * KILLS_IN_A_ROW  # signals that may come after the end before a case is given up
EARLIEST, LATEST = 0.1, 1.0  # kills come within these shares of the processor time of an undisturbed command
SEED = 20

REQUIREMENTS = (
    Requirement("files that differ from an undisturbed command's", "different", "<=", 0),
    Requirement("files and folders left behind", "left", "<=", 0),
    Requirement("stopped runs whose record does not replay", "unreadable", "<=", 0),
    Requirement("tracebacks and internal errors", "tracebacks", "<=", 0),
)


def measure(*, kills: int = 0, first: int = 0, quick: bool = False) -> dict[str, Any]:
    """Run the benchmark; everything in it can be written as JSON.

    Args:
        kills: How many processes to kill; 0 for 200, or 8 when `quick`.
        first: Number of the first case. Each case is four kills, drawn from its number, so that parts of a long
            benchmark can be run one by one: `--kills 100`, then `--kills 100 --first 25`.
        quick: Few kills.
    """
    count = kills or (QUICK_KILLS if quick else KILLS)
    with tempfile.TemporaryDirectory(prefix="mjsim-faults-") as folder:
        return _Kills(Path(folder)).measure(first, count)


def lines(result: Mapping[str, Any]) -> Iterator[str]:
    """The result, for people."""
    sent = ", ".join(f"{number} {name}" for name, number in result["signals"].items())
    cases = f"cases {result['first']} to {result['last']}"
    yield f"{result['kills']} kills ({sent}): {result['runs']} of runs, {result['batches']} of batches; {cases}"
    yield f"{result['too_late']} more came after the end; {result['kept']} stopped runs kept a record"
    yield from requirement_lines(result, REQUIREMENTS)
    yield from result["faults"]


class _Kills:
    """Kills commands in a folder and counts what comes of it."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._expected = {RUN: folder / "expected" / "run", BATCH: folder / "expected" / "batch"}
        self._cpu: dict[Command, float] = {}  # processor time of an undisturbed command, s
        self._counts: dict[str, Any] = dict.fromkeys(
            ("kills", "runs", "batches", "too_late", "kept", "different", "left", "unreadable", "tracebacks"),
            0,
        )
        self._signals = {number.name: 0 for number in SIGNALS}
        self._faults: list[str] = []

    def measure(self, first: int, count: int) -> dict[str, Any]:
        """Kill `count` processes, in cases from `first` on."""
        last = first + -(-count // KILLS_IN_A_ROW) - 1
        for case in track(range(first, last + 1), "cases of four kills", console=Console(stderr=True)):
            self._run_case(case, min(KILLS_IN_A_ROW, count - self._counts["kills"]))
        return {
            **self._counts,
            "first": first,
            "last": last,
            "signals": self._signals,
            "faults": self._faults,
        }

    def _run_case(self, case: int, kills: int) -> None:
        """Kill a command so many times, then let it finish and look at what is there."""
        rng = np.random.default_rng([SEED, case])
        command = RUN if rng.random() < 0.5 else BATCH
        if command not in self._cpu:
            self._cpu[command] = self._undisturbed(command)
        place = self._folder / f"case{case}"
        place.mkdir()
        out = place / command.words[0]
        aim = self._counts["kills"] + kills
        for _ in range(TRIES):
            if self._counts["kills"] < aim and not self._kill(command, out, rng):
                self._compare(command, out)
                shutil.rmtree(out)
        finish(command, out, *_more(command, out))
        self._compare(command, out)
        shutil.rmtree(place)

    def _undisturbed(self, command: Command) -> float:
        """Run a command to its end, twice: the first time may compile kernels; its processor time, s."""
        self._expected[command].parent.mkdir(exist_ok=True)
        finish(command, self._folder / "expected" / f"first-{command.words[0]}")
        return finish(command, self._expected[command])

    def _kill(self, command: Command, out: Path, rng: np.random.Generator) -> bool:
        """Start a command and kill it; whether it was still at work."""
        number = SIGNALS[rng.integers(len(SIGNALS))]
        moment = float(rng.uniform(EARLIEST, LATEST)) * self._cpu[command]
        group = bool(rng.random() < 0.5)
        code = kill(start(command, out, *_more(command, out)), number, moment, group=group)
        if code == 0:
            self._counts["too_late"] += 1
        else:
            self._counts["kills"] += 1
            self._counts["batches" if command.is_batch else "runs"] += 1
            self._signals[number.name] += 1
        said = out.with_suffix(".txt").read_text()
        if "Traceback" in said or "internal error" in said:
            where = f"{out.parent.name}, {number.name} after {moment:.2f} s"
            self._fault("tracebacks", f"{where}: {said[-400:]!r}")
        if not command.is_batch and out.exists():
            self._check_run(out)
        return code != 0

    def _check_run(self, out: Path) -> None:
        """Whether the record of a run that was stopped replays."""
        ended = json.loads((out / records.METRICS).read_text())["ended"]
        self._counts["kept"] += ended == "interrupted"
        try:
            replay(out)
        except ExperimentError as error:
            self._fault("unreadable", f"{out.parent.name}: {error}")

    def _compare(self, command: Command, out: Path) -> None:
        for name in differences(out, self._expected[command]):
            self._fault("different", f"{out.parent.name}: {out.name}/{name} differs")
        for name in leftovers(out.parent, [out.name, f"{out.name}.txt", "tmp"]):
            self._fault("left", f"{out.parent.name}: {name} was left behind")

    def _fault(self, kind: str, text: str) -> None:
        self._counts[kind] += 1
        self._faults.append(text)


def _more(command: Command, out: Path) -> list[str]:
    """What a command needs to begin anew where an earlier one left something."""
    return ["--force"] if out.exists() and not command.is_batch else []
