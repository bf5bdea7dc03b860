"""Create the training before a task, which is a trial with a single object (PAPER section 7)."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from msgspec.structs import replace

from experiments.record.phases import TASK, TRAINING
from experiments.trials.trial_config import NO_ASSISTANCE, TrialConfig

TRAINING_LIMIT_S = 3600.0  # time limit of the training for simulated participants
HUMAN_TRAINING_LIMIT_S = 24 * 3600.0
_TRAINING_SEED = 7  # makes the house seed of the training differ from the seed of the task


def training_config(config: TrialConfig) -> TrialConfig:
    """Return the settings of the training before a trial, with one object in the same house."""
    seed = int(np.random.SeedSequence([config.house_seed, _TRAINING_SEED]).generate_state(1)[0])
    return replace(
        config,
        objects=1,
        points=1,
        assistance=config.training_assistance,
        training_assistance=NO_ASSISTANCE,
        house_seed=seed,
        episode=None,
        phases=TASK,
        story=None,
        time_limit=TRAINING_LIMIT_S,
    )


def trials_of(task: TrialConfig) -> Mapping[str, dict[str, Any]]:
    """Return the settings of a participant's training and task, by phase."""
    training = replace(training_config(task), time_limit=HUMAN_TRAINING_LIMIT_S)
    return {TRAINING: training.settings(), TASK: task.settings()}
