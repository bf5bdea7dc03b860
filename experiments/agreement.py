"""The same trials in every fidelity: what was delivered, how long it took, how quick the simulation was."""

import dataclasses
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from multiprocessing import get_context
from typing import Any

from experiments.house import House
from experiments.metrics import compute_metrics
from experiments.records import EventLog
from experiments.trial import TrialConfig, prepare_session
from mjsim.model.scene import Scene, compose
from mjsim.observation import ObjectStatus
from mjsim.options import FIDELITIES
from planner.replanner import Replanner
from planner.route import Route, TaskState
from planner.solver import solver


@dataclass(frozen=True)
class Ran:
    """One trial in one fidelity.

    Attributes:
        config: The trial.
        delivered: Names of what lay in its receptacle at the end.
        metrics: The paper's metrics, by name.
        simulated_s: Length of the trial, s.
        cpu_s: CPU time of it, s: world, session, participant and log; neither the planner nor setting up.
    """

    config: TrialConfig
    delivered: frozenset[str]
    metrics: dict[str, Any]
    simulated_s: float
    cpu_s: float


class TimedReplanner(Replanner):
    """Plans, and knows how much CPU time that took, s."""

    seconds = 0.0

    def update(self, state: TaskState) -> Route:
        """As any replanner."""
        before = time.process_time()
        route = super().update(state)
        self.seconds += time.process_time() - before
        return route


def run_in(config: TrialConfig, house: House, scene: Scene | None = None) -> Ran:
    """Run a trial without any record on disk, in its composed episode if that is at hand."""
    scene = scene or _scene(config, house)
    replanner = TimedReplanner(house.geodesics, solver(config.planner))
    log = EventLog()
    session, world = prepare_session(config, house, scene, log, replanner=replanner)
    before = time.process_time()
    session.run()
    seconds = time.process_time() - before - replanner.seconds
    end = world.observation()
    return Ran(
        config=config,
        delivered=frozenset(end.names_with(ObjectStatus.DELIVERED)),
        metrics=dataclasses.asdict(compute_metrics(log.events, session.trajectory.arrays()["position"])),
        simulated_s=end.time,
        cpu_s=seconds,
    )


def in_every_fidelity(
    configs: Sequence[TrialConfig],
    *,
    workers: int = 1,
    on_done: Callable[[int, int], None] = lambda *_: None,
) -> list[dict[str, Ran]]:
    """Run trials in every fidelity.

    Args:
        configs: The trials; their own fidelity is ignored.
        workers: Processes.
        on_done: Called with the trials done and those in all.

    Returns:
        For each trial, fidelity -> what came of it.
    """
    results = []
    for result in _all(configs, workers):
        results.append(result)
        on_done(len(results), len(configs))
    return results


def _all(configs: Sequence[TrialConfig], workers: int) -> Iterator[dict[str, Ran]]:
    if workers == 1:
        yield from map(_one, configs)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield from pool.map(_one, configs)


def _one(config: TrialConfig) -> dict[str, Ran]:
    house = _house(config.house)
    scene = _scene(config, house)
    return {name: run_in(dataclasses.replace(config, fidelity=name), house, scene) for name in FIDELITIES}


def _scene(config: TrialConfig, house: House) -> Scene:
    return compose(house.sample_episode(objects=config.objects, seed=config.seed), house.catalogue)


@cache
def _house(name: str) -> House:
    """One house per process, its kernels compiled and its memories filled by a first short trial."""
    house = House.load(name)
    for fidelity in FIDELITIES:
        run_in(TrialConfig(objects=2, assistance="optimal", seed=0, house=name, fidelity=fidelity), house)
    return house
