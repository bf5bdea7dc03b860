"""Validate a study file before a command starts something with it."""

import functools
import importlib.util
from collections.abc import Callable, Sequence
from pathlib import Path

from experiments.errors import ConfigError
from experiments.house import House
from experiments.study.file import Study, read_people_study
from experiments.trials.batch_plan import Houses, check_names, check_settings
from experiments.trials.design import read_design
from experiments.trials.setup import trial_episode
from experiments.trials.toml_file import TomlFile
from experiments.trials.trial_config import TrialConfig
from experiments.visit.phases import phases_of
from experiments.visit.recruiter import OpenLink
from mjsim.house.catalogue.generated_names import is_generated
from mjsim.house.compiled.house import MAX_HOUSES
from mjsim.values.errors import MjsimError


def check_study(path: Path, *, recruits: bool = False) -> Study | None:
    """Check that everything that a study file names exists, including houses, conditions and phases.

    Return the study with people, or None if the file is only a design.

    Args:
        recruits: True to require the settings of the recruitment platform, such as completion codes.

    Raises:
        ConfigError: A value is invalid. The message names the line, the key, the value and the choices.
    """
    house = functools.lru_cache(MAX_HOUSES)(House.load)
    read_design(path, lambda trials: _check_cell(trials, house))
    file = TomlFile.read(path, "study")
    if "study" not in file.content:
        return None
    study = read_people_study(path)
    if importlib.util.find_spec("httpx") is None:  # Only visits by people need the extra `people`.
        return study
    from experiments.study.plan import plan_of

    try:
        phases_of(plan_of(study, platform=None if recruits else OpenLink()))
    except ConfigError as error:
        raise file.fault(error, "study") from error
    return study


def check_homes(study: Study, on_home: Callable[[str], object]) -> None:
    """Load all houses of a study, which generates them, and sample the objects of all trials.

    Raises:
        ConfigError: A home cannot be generated or used, or has too few places for the objects.
    """
    load = functools.lru_cache(MAX_HOUSES)(House.load)
    trials = {(t.house, t.house_seed, t.objects, t.points): t for cell in study.cells for t in cell.trials}
    for trial in trials.values():
        on_home(trial.house)
        try:
            trial_episode(trial, load(trial.house))
        except MjsimError as error:
            raise ConfigError(
                f"{study.path}: {trial.house}, house seed {trial.house_seed}: {error}"
            ) from error


def _check_cell(trials: Sequence[TrialConfig], house: Houses) -> None:
    check_names(trials)
    homes = {trial.house for trial in trials if is_generated(trial.house)}
    # Generating the homes of a range takes long. The trials in them check their points.
    check_settings([t for t in trials if len(homes) < 2 or t.house not in homes], house)
