"""Estimate the cost and the duration of a study, and the effect sizes that it can detect."""

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import mean
from typing import Any

import msgspec

from experiments.analysis.statistics.effects import POWER, detectable_eta_squared
from experiments.house import House
from experiments.record.phases import FLYTHROUGH, HUMAN, TASK, TRAINING
from experiments.session.camera_path import camera_path
from experiments.session.familiarise import READING_SPEED
from experiments.study.file import Cell, Study
from experiments.trials.design import read_design
from experiments.trials.training import training_config
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from experiments.visit.phases.base import Phase
from mjsim.house.compiled.house import MAX_HOUSES

# Time to choose and click an answer, in seconds (Card, Moran and Newell, CACM 23, 1980)
CHOOSING = 2.65
WRITING = 20.0  # assumed time to write a free-text answer, in seconds
PEOPLE = 2  # number of participants simulated in each cell
GUEST = "guest"  # simulated participant that is used if the study file names none


@dataclass(frozen=True)
class TrialDurations:
    """The mean durations of simulated trials, in seconds."""

    training: float
    tasks: Mapping[str, float]  # duration of the task in each cell, by label


def simulate(study: Study, folder: Path, on_trial: Callable[[str], None]) -> TrialDurations:
    """Simulate some trials of each cell, write their records to a folder, and return the mean durations."""
    trials = [_simulated(cell, study.path) for cell in study.cells]
    load = functools.lru_cache(MAX_HOUSES)(House.load)

    def seconds(name: str, config: TrialConfig) -> float:
        on_trial(name)
        path = folder / f"{name}".replace(" ", "-").replace(",", "")
        return float(run_trial(config, path, topdown=False, house=load(config.house))["simulated_s"])

    tasks = {}
    for cell, own in zip(study.cells, trials, strict=True):
        times = [seconds(f"{cell.label} {k}", trial) for k, trial in enumerate(own)]
        tasks[cell.label] = mean(times)
    trained = TRAINING in study.settings.phases
    return TrialDurations(seconds(TRAINING, training_config(trials[0][0])) if trained else 0.0, tasks)


def _simulated(cell: Cell, path: Path) -> list[TrialConfig]:
    wanted = {(trial.house_seed, trial.person_seed, trial.order_seed) for trial in cell.trials[:PEOPLE]}
    usual: dict[str, Any] = {"fidelity": "event", "regret": False, "phases": TASK}
    first = cell.trials[0]
    found = [
        msgspec.structs.replace(trial, **usual, live=False)
        for trial in read_design(path).trials
        if (trial.assistance, trial.objects) == (first.assistance, first.objects)
        and (trial.house_seed, trial.person_seed, trial.order_seed) in wanted
    ]
    return [t if t.user != HUMAN else msgspec.structs.replace(t, user=GUEST) for t in found]


def durations(
    study: Study, phases: Sequence[Phase], words: Mapping[str, int], played: TrialDurations
) -> dict[str, float]:
    """Return the expected duration of each phase, in seconds.

    A duration includes reading, answering, watching the video and playing, and is not below the minimum.
    """
    found = {}
    for phase in phases:
        items = getattr(phase, "items", ())
        answering = sum(
            (WRITING if item.kind in ("line", "text") else CHOOSING) for item in items if item.required
        )
        seconds = 60.0 * words.get(phase.name, 0) / READING_SPEED + answering
        if phase.name == FLYTHROUGH:
            seconds += camera_path(House.load(study.cells[0].trial(0).house)).duration
        seconds += {TRAINING: played.training, TASK: mean(played.tasks.values())}.get(phase.name, 0.0)
        found[phase.name] = max(seconds, study.settings.minimum.get(phase.name, 0.0))
    return found


@dataclass(frozen=True)
class Cost:
    """The estimated cost of a study, in units of its currency.

    Attributes:
        rewards: Total of the rewards if all participants finish.
        bonuses: Total of the bonuses if all participants earn them.
        fee: Platform fee on rewards and bonuses, or None if the study file does not specify it.
        hourly: Hourly wage if a visit takes as long as announced.
    """

    rewards: float
    bonuses: float
    fee: float | None
    hourly: float

    @property
    def total(self) -> float:
        """The maximum cost, excluding payments to screened-out participants."""
        return self.rewards + self.bonuses + (self.fee or 0.0)


def cost(study: Study) -> Cost:
    pay = study.settings.pay
    rewards, bonuses = study.people * pay.reward, study.people * pay.bonus_for_all
    fee = None if pay.fee is None else pay.fee * (rewards + bonuses)
    return Cost(rewards, bonuses, fee, 60.0 * pay.reward / study.settings.minutes)


def detectable(study: Study) -> dict[str, float]:
    """Return the smallest partial eta squared of each effect that is detected with 80 % power at p < .05."""
    conditions = {cell.trials[0].assistance for cell in study.cells}
    levels = {cell.trials[0].objects for cell in study.cells}
    if len(conditions) * len(levels) != len(study.cells) or study.people <= len(study.cells):
        return {}
    freedom = {"assistance": len(conditions) - 1, "objects": len(levels) - 1}
    freedom["interaction"] = freedom["assistance"] * freedom["objects"]
    rest = study.people - len(study.cells)
    return {
        name: detectable_eta_squared(df, rest, study.people, POWER) for name, df in freedom.items() if df > 0
    }
