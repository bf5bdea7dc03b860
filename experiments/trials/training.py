"""The training before a task: a trial with one object and practically no time limit (PAPER section 7)."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from msgspec.structs import replace

from experiments.record.phases import TASK, TRAINING
from experiments.trials.trial_config import NO_ASSISTANCE, TrialConfig

TRAINING_LIMIT_S = 3600.0  # time limit of the training for simulated participants
HUMAN_TRAINING_LIMIT_S = 24 * 3600.0
_TRAINING_SEED = 7  # distinguishes the house seed of the training from that of the task


def training_config(config: TrialConfig) -> TrialConfig:
    """Return the training of a trial: one object in the same house, at a different location than in the task."""
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
    """Return the settings of a person's training and task, by phase."""
    training = replace(training_config(task), time_limit=HUMAN_TRAINING_LIMIT_S)
    return {TRAINING: training.settings(), TASK: task.settings()}
