"""The training trial: one object, as long as it takes (PAPER section 7)."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from msgspec.structs import replace

from experiments.record.phases import TASK, TRAINING
from experiments.trials.trial_config import NO_ASSISTANCE, TrialConfig

TRAINING_LIMIT = 3600.0  # seconds, for a simulated participant
HUMAN_TRAINING_LIMIT = 24 * 3600.0  # seconds, for a person; no one reaches it
_TRAINING_SEED = 7  # sets the house of the training apart from that of the task


def training_config(config: TrialConfig) -> TrialConfig:
    """The training trial that belongs to a trial: one object in the same house, without limit of time.

    Person and fidelity are those of the trial; its assistance has a setting of its own. The object lies where the
    house's seed says, but elsewhere than in the task.
    """
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
        time_limit=TRAINING_LIMIT,
    )


def trials_of(task: TrialConfig) -> Mapping[str, dict[str, Any]]:
    """Return the settings of a person's task and of the training before it, by phase."""
    training = replace(training_config(task), time_limit=HUMAN_TRAINING_LIMIT)
    return {TRAINING: training.settings(), TASK: task.settings()}
