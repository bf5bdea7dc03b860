"""Compile all numeric kernels in advance, so that later processes can load them from disk.

Run `python -m experiments.trials.warmup` once after the installation. This takes a minute, or a few seconds
if all kernels are already compiled.
"""

import contextlib
import math
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numba.core.event import Event, Listener, register

from experiments.house import House
from experiments.record.records import EventLog
from experiments.trials.setup import prepare_session
from experiments.trials.trial_config import TrialConfig
from hud.conditions import CONDITIONS
from mjsim.house.scene.scene import Scene, compose
from mjsim.support.kernels import cache_base, cache_folder
from mjsim.values.actions import WAIT, FollowPath, Move, Pick, Place
from mjsim.values.episode import Episode, PlacedObject, StartPose
from mjsim.values.options import FIDELITIES, WorldOptions
from mjsim.world.world import World
from planner.exact.solver import ExactSolver
from planner.exact.warm_start import NOTHING_KNOWN
from planner.problem import RoutingProblem, Shipment
from planner.regret import regrets

TRIALS = (("full", 2.0), ("event", 60.0))  # fidelity and duration (simulated seconds) of each short trial


def compile_kernels(house: House | None = None) -> None:
    """Run every kernel once, with the argument types that are used in trials."""
    house = house or House.load()
    plan()
    act(house)
    play(house)


def plan() -> None:
    """Solve a routing problem in every way that trials use, in order to compile the planner's kernels."""
    places = np.random.default_rng(0).random((16, 2))
    distances = np.linalg.norm(places[:, None] - places[None], axis=2)
    for resolution in (1e-4, None):
        shipments = tuple(Shipment(4 + k, 1 + k % 3) for k in range(12))
        tour = RoutingProblem(distances, 0, shipments, (), 2, resolution=resolution)
        for table_bytes in (ExactSolver.table_bytes, 0):
            ExactSolver(table_bytes=table_bytes).solve(tour)
            regrets(tour, ExactSolver(table_bytes=table_bytes))
        searching = ExactSolver(table_bytes=0)
        warm = NOTHING_KNOWN.updated(tour, searching.solve(tour))
        next(searching.improve(tour, warm=warm))


def act(house: House) -> None:
    scene = _before_a_receptacle(house)
    start = np.array([scene.episode.start.x, scene.episode.start.y])
    path = FollowPath(np.array([start, start + 1.0]), start + 1.0, 0.5)
    for tier in FIDELITIES:
        world = World(scene, WorldOptions(fidelity=tier))
        for action in (Move(0.2, 0.1, 0.3, 0.1), Pick(), Move(-0.2), Place()):
            world.step(action)
            world.step(WAIT)
            world.step(path, 3)


def play(house: House) -> None:
    scene = compose(house.sample_episode(objects=2, seed=0), house.catalogue, visuals=False)
    for assistance in CONDITIONS:
        for fidelity, until in TRIALS:
            config = TrialConfig(
                objects=2, assistance=assistance, seed=0, fidelity=fidelity, time_limit=until, regret=False
            )
            prepare_session(config, house, scene, EventLog())[0].run()


def _before_a_receptacle(house: House) -> Scene:
    key, receptacle = next(iter(house.receptacles.items()))
    x, y = receptacle.approach.tolist()
    heading = math.atan2(receptacle.center[1] - y, receptacle.center[0] - x)
    category = next(c for c in house.catalogue.categories.values() if c.receptacle == key)
    spot = (x - 0.5 * math.cos(heading), y - 0.5 * math.sin(heading))
    placed = PlacedObject(
        "object", category.key, category.objects[0], spot, (*spot, 0.01), (1.0, 0.0, 0.0, 0.0)
    )
    start, keys = StartPose(x, y, heading), tuple(house.receptacles)
    return compose(
        Episode(house.catalogue.name, 0, start, (placed,), keys, {placed.name: key}), house.catalogue
    )


if __name__ == "__main__":
    compile_kernels()


NOTICE = "compiling numeric code for the first time since the last update; this takes up to a minute"
NOT_KEPT = (
    "compiling numeric code, which takes up to a minute at every command because {folder} is not writable; "
    "set NUMBA_CACHE_DIR to a folder that is"
)


class _Notice(Listener):  # type: ignore[misc]  # numba has no types
    def __init__(self, may_print: Callable[[], bool]) -> None:
        self._may_print = may_print
        self._seen = False

    def on_start(self, event: Event) -> None:
        first, self._seen = not self._seen, True
        if first and sys.stderr is not None and self._may_print():
            kept = cache_folder(Path(event.data["dispatcher"].py_func.__code__.co_filename)) is not None
            with contextlib.suppress(OSError):  # the standard error stream may be closed
                sys.stderr.write(f"mjsim: {NOTICE if kept else NOT_KEPT.format(folder=cache_base())}\n")
                sys.stderr.flush()

    def on_end(self, event: Event) -> None: ...


def announce_compiling(may_print: Callable[[], bool] = lambda: True) -> None:
    """Print a notice to standard error when the first kernel is compiled, if `may_print` returns True."""
    register("numba:compile", _Notice(may_print))
