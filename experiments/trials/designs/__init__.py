"""Study files of this package, the metrics to analyse, and studies with simulated participants."""

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
    """Return the path of a study file. `name` is a path, or the name of a study in this package (`paper`)."""
    own, packaged = Path(name), FOLDER / f"{name}.toml"
    if not own.is_file() and not packaged.is_file():
        raise ConfigError(
            f"no study {name!r}; give the path of a design file, or `paper` for the published study"
        )
    return own if own.is_file() else packaged


def read_study(path: Path, people: int | None = None) -> Design:
    """Read the simulated participants of a study file, alternating between its cells. `people` limits their number.

    Raises:
        ConfigError: The file, the number, or a trial for a person is invalid.
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
