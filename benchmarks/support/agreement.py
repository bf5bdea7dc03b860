"""Run the same trials at every fidelity and compare the delivered objects and the metrics."""

import dataclasses
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache
from multiprocessing import get_context
from typing import Any

import msgspec

from experiments.house import House
from experiments.record.metrics import compute_metrics
from experiments.record.records import EventLog
from experiments.trials.setup import prepare_session, trial_episode
from experiments.trials.trial_config import TrialConfig
from mjsim.house.scene.scene import compose
from mjsim.values.observation import ObjectStatus
from mjsim.values.options import FIDELITIES


@dataclass(frozen=True)
class TierResult:
    """The result of a trial at one fidelity. `delivered` contains the names of the delivered objects."""

    config: TrialConfig
    delivered: frozenset[str]
    metrics: dict[str, Any]


def run_in_tiers(config: TrialConfig, house: House) -> dict[str, TierResult]:
    """Run a trial at every fidelity, without writing a record. The fidelity in its settings is ignored."""
    scene = compose(trial_episode(config, house), house.catalogue)
    results = {}
    for fidelity in FIDELITIES:
        tier = msgspec.structs.replace(config, fidelity=fidelity)
        log = EventLog()
        session, world = prepare_session(tier, house, scene, log)
        session.run()
        metrics = compute_metrics(log.events, session.record.record().trajectory["position"])
        delivered = world.observation().names_with(ObjectStatus.DELIVERED)
        results[fidelity] = TierResult(tier, frozenset(delivered), dataclasses.asdict(metrics))
    return results


def run_all_in_tiers(configs: Sequence[TrialConfig], *, workers: int = 1) -> Iterator[dict[str, TierResult]]:
    """Run trials at every fidelity in several processes. Yield each trial's results by fidelity."""
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield from pool.map(_run_one, configs)


def _run_one(config: TrialConfig) -> dict[str, TierResult]:
    return run_in_tiers(config, _house(config.house))


_house = cache(House.load)  # every process loads the house only once
