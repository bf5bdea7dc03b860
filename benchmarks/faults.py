"""Runs and batches that are killed at seeded moments and begun again: are their files those of undisturbed ones?"""

import json
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

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

KILLS, QUICK_KILLS = 200, 6
KILLS_IN_A_ROW = 4  # before a command is left to finish
EARLIEST, LATEST = 0.1, 1.0  # kills come within these shares of the processor time of an undisturbed command
SEED = 20

REQUIREMENTS = (
    Requirement("files that differ from an undisturbed command's", "different", "<=", 0),
    Requirement("files and folders left behind", "left", "<=", 0),
    Requirement("stopped runs whose record does not replay", "unreadable", "<=", 0),
    Requirement("tracebacks and internal errors", "tracebacks", "<=", 0),
)


def measure(*, kills: int = 0, quick: bool = False) -> dict[str, Any]:
    """Run the benchmark; everything in it can be written as JSON.

    Args:
        kills: How many processes to kill; 0 for 200, or 6 when `quick`.
        quick: Few kills.
    """
    count = kills or (QUICK_KILLS if quick else KILLS)
    with tempfile.TemporaryDirectory(prefix="mjsim-faults-") as folder:
        return _Kills(Path(folder), np.random.default_rng(SEED)).measure(count)


def lines(result: Mapping[str, Any]) -> Iterator[str]:
    """The result, for people."""
    sent = ", ".join(f"{number} {name}" for name, number in result["signals"].items())
    yield f"{result['kills']} kills ({sent}): {result['runs']} of runs, {result['batches']} of batches"
    yield f"{result['too_late']} more came after the end; {result['kept']} stopped runs kept a record"
    yield from requirement_lines(result, REQUIREMENTS)
    yield from result["faults"]


class _Kills:
    """Kills commands in a folder and counts what comes of it."""

    def __init__(self, folder: Path, rng: np.random.Generator) -> None:
        self._folder, self._rng = folder, rng
        self._expected = {RUN: folder / "expected" / "run", BATCH: folder / "expected" / "batch"}
        self._cpu = {command: self._undisturbed(command) for command in (RUN, BATCH)}
        self._counts: dict[str, Any] = dict.fromkeys(
            ("kills", "runs", "batches", "too_late", "kept", "different", "left", "unreadable", "tracebacks"),
            0,
        )
        self._signals = {number.name: 0 for number in SIGNALS}
        self._faults: list[str] = []

    def measure(self, count: int) -> dict[str, Any]:
        """Kill `count` processes."""
        while self._counts["kills"] < count:
            place = self._folder / f"case{self._counts['kills']}"
            place.mkdir()
            left = count - self._counts["kills"]
            command = RUN if self._rng.random() < 0.5 else BATCH
            out = place / command.words[0]
            for _ in range(min(KILLS_IN_A_ROW, left)):
                self._kill(command, out)
            finish(command, out, *_more(command, out))
            self._compare(command, out)
            shutil.rmtree(place)
        return {**self._counts, "signals": self._signals, "faults": self._faults}

    def _undisturbed(self, command: Command) -> float:
        """Run a command to its end, twice: the first time may compile kernels; its processor time, s."""
        self._expected[command].parent.mkdir(exist_ok=True)
        finish(command, self._folder / "expected" / f"first-{command.words[0]}")
        return finish(command, self._expected[command])

    def _kill(self, command: Command, out: Path) -> None:
        number = SIGNALS[self._rng.integers(len(SIGNALS))]
        moment = float(self._rng.uniform(EARLIEST, LATEST)) * self._cpu[command]
        group = bool(self._rng.random() < 0.5)
        code = kill(start(command, out, *_more(command, out)), number, moment, group=group)
        if code == 0:
            self._counts["too_late"] += 1
        else:
            self._counts["kills"] += 1
            self._counts["batches" if command.is_batch else "runs"] += 1
            self._signals[number.name] += 1
        said = out.with_suffix(".txt").read_text()
        if "Traceback" in said or "internal error" in said:
            self._fault("tracebacks", f"{out.name}, {number.name} after {moment:.2f} s: {said[-400:]!r}")
        if not command.is_batch and out.exists():
            self._check_run(out)

    def _check_run(self, out: Path) -> None:
        """Whether the record of a run that was stopped replays."""
        ended = json.loads((out / records.METRICS).read_text())["ended"]
        self._counts["kept"] += ended == "interrupted"
        try:
            replay(out)
        except ExperimentError as error:
            self._fault("unreadable", str(error))

    def _compare(self, command: Command, out: Path) -> None:
        for name in differences(out, self._expected[command]):
            self._fault("different", f"{out.name}/{name} differs")
        for name in leftovers(out.parent, [out.name, f"{out.name}.txt", "tmp"]):
            self._fault("left", f"{name} was left behind")

    def _fault(self, kind: str, text: str) -> None:
        self._counts[kind] += 1
        self._faults.append(text)


def _more(command: Command, out: Path) -> list[str]:
    """What a command needs to begin anew where an earlier one left something."""
    return ["--force"] if out.exists() and not command.is_batch else []
