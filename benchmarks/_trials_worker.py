"""A worker process that runs the trials of a batch and measures how long each part of the program takes.

The trials benchmark passes a JSON list of fidelity, assistance, participant, objects and seeds, and reads a
JSON object. Run it with `python -P`, because modules in this folder have the same names as packages.
"""

import json
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from pkgutil import resolve_name
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from benchmarks.support.recorded_trial import RecordingWorld, play
from experiments.house import House
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from mjsim.house.scene.scene import Scene
from mjsim.values.options import WorldOptions
from mjsim.world.world import World

# Functions that count as a part of the program. Time in nested calls counts for the outermost function.
PARTS = {
    "planning": (  # only waiting times, because planning runs in another thread
        "planner.service.Planner.ask",
        "concurrent.futures._base.Future.result",
        "concurrent.futures.thread.ThreadPoolExecutor.shutdown",
    ),
    "shortest paths": ("planner.geodesics.Geodesics.shortest_path",),
    "looking": ("experiments.session.perception.visible_objects",),
    "world": tuple(f"mjsim.world.world.World.{n}" for n in ("reset", "step", "state", "restore")),
    "house and scene": (
        "experiments.house.House.sample_episode",
        "experiments.trials.trial.compose",
        "mjsim.world.world.World.__init__",
    ),
    "recording": (
        "experiments.record.records.EventLog.append",
        "experiments.record.writer.RecordWriter.append",
        "experiments.record.writer.RecordWriter.record",
        "experiments.record.writer.save_arrays",
        "experiments.record.writer.write_json",
        "mjsim.values.episode.Episode.save",
    ),
}
REST = "participant and the rest"


class Timers:
    """A context manager that measures the wall-clock time that the main thread spends in each of `PARTS`."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = defaultdict(float)
        self._is_inside = False
        self._patches = ExitStack()

    def __enter__(self) -> "Timers":
        for part, names in PARTS.items():
            for name in names:
                self._patches.enter_context(patch(name, self._timed(part, resolve_name(name))))
        return self

    def __exit__(self, *_: object) -> None:
        self._patches.close()

    def _timed(self, part: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*arguments: Any, **keywords: Any) -> Any:
            if self._is_inside or threading.current_thread() is not threading.main_thread():
                return function(*arguments, **keywords)
            self._is_inside, started = True, time.perf_counter()
            try:
                return function(*arguments, **keywords)
            finally:
                self._is_inside = False
                self.seconds[part] += time.perf_counter() - started

        return timed


def main() -> None:
    """Run the trials, then repeat their recorded calls on worlds without any participant model."""
    fidelity, assistance, user, objects, seeds = json.loads(sys.argv[1])
    started = time.perf_counter()
    house = House.load()
    house_s = time.perf_counter() - started
    worlds: list[RecordingWorld] = []

    def recording_world(scene: Scene, options: WorldOptions, walls: NDArray[np.float64]) -> World:
        worlds.append(RecordingWorld(scene, options, walls=walls))
        return worlds[-1]

    timers, trials_s, bare_s = Timers(), 0.0, 0.0
    for seed in range(seeds):
        config = TrialConfig(
            objects=objects, assistance=assistance, seed=seed, user=user, fidelity=fidelity, regret=False
        )
        with (
            tempfile.TemporaryDirectory() as folder,
            timers,
            patch("experiments.trials.setup.World", recording_world),
        ):
            started = time.perf_counter()
            run_trial(config, Path(folder) / "run", topdown=False, house=house)
            trials_s += time.perf_counter() - started
        recorded = worlds.pop()
        world = World(recorded.scene, recorded.options, walls=house.navmesh.outline)
        world.reset()
        started = time.perf_counter()
        play(world, recorded.calls)
        bare_s += time.perf_counter() - started
    parts = {part: timers.seconds[part] for part in PARTS}
    parts[REST] = trials_s - sum(parts.values())
    print(json.dumps({"house_s": house_s, "bare_s": bare_s, "parts": parts}))


if __name__ == "__main__":
    main()
