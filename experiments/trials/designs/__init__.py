"""Study files that come with this package, and functions that find and read them."""

import itertools
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from experiments.errors import ConfigError
from experiments.record.phases import HUMAN, is_simulated
from experiments.trials.design import Design, read_design
from experiments.trials.trial_config import TrialConfig

FOLDER = Path(__file__).parent


def study_path(name: str) -> Path:
    """Return the path of a study file. `name` is a path or the name of an included study such as `paper`."""
    own, packaged = Path(name), FOLDER / f"{name}.toml"
    if not own.is_file() and not packaged.is_file():
        raise ConfigError(
            f"no study {name!r}; give the path of a design file, or `paper` for the published study"
        )
    return own if own.is_file() else packaged


def read_study(path: Path, people: int | None = None) -> Design:
    """Read the trials of all simulated participants in a study file, or of the first `people` participants.

    Raises:
        ConfigError: The file or the number of participants is invalid, or a trial is for human participants.
    """
    cells: dict[Any, dict[str, list[TrialConfig]]] = {}
    for trial in read_design(path).trials:
        if not is_simulated(trial.user):
            raise ConfigError(f"{path}: user {HUMAN} cannot be simulated; name a participant model")
        houses = cells.setdefault((trial.assistance, trial.objects, trial.user), {})
        houses.setdefault(trial.house, []).append(trial)
    in_turn = _in_turn(_in_turn(houses.values()) for houses in cells.values())
    if people is None:
        return Design(tuple(in_turn))
    first = [trial for trial in in_turn if trial.trial_number == 1]
    if not 1 <= people <= len(first):
        raise ConfigError(f"--people {people} must be 1 to {len(first)}, the people of {path}")
    chosen = set(first[:people])
    wanted = {_person(trial) for trial in chosen}
    return Design(tuple(t for t in in_turn if t in chosen or (t.trial_number > 1 and _person(t) in wanted)))


def _in_turn(groups: Iterable[list[TrialConfig]]) -> list[TrialConfig]:
    return [trial for turn in itertools.zip_longest(*groups) for trial in turn if trial is not None]


def _person(trial: TrialConfig) -> Any:
    return trial.assistance, trial.objects, trial.user, trial.person_seed, trial.order_seed
