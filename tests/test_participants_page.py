"""The page about participants: its example runs, and its table says what holds."""

import dataclasses
import sys
import tomllib
from pathlib import Path

from experiments.participants.behaviour import BehaviourDistribution
from experiments.participants.guest import PARAMETERS
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig

PAGE = (Path(__file__).parents[1] / "docs" / "participants.md").read_text(encoding="utf-8")


def test_the_example_tidies_a_house_and_goes_for_what_is_far(tmp_path, monkeypatch):
    (tmp_path / "own.py").write_text(PAGE.split("```python\n")[1].split("```")[0], encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    config = TrialConfig(
        objects=3, assistance="highlight", seed=0, user="own:build", fidelity="event", regret=False
    )
    try:
        own = run_trial(config, tmp_path / "own", topdown=False)
    finally:
        sys.modules.pop("own", None)
    near = run_trial(dataclasses.replace(config, user="nearest"), tmp_path / "near", topdown=False)
    assert own["delivered"] == near["delivered"] == 3
    assert own["task_distance_m"] > near["task_distance_m"]


def test_the_table_lists_every_parameter_with_its_range():
    for name, parameter in PARAMETERS.items():
        (row,) = [line for line in PAGE.splitlines() if line.startswith(f"| `{name}` |")]
        assert f"| {parameter.lowest:g} to {parameter.highest:g} | {parameter.unit} |" in row


def test_the_example_of_a_cell_describes_behaviour():
    cell = tomllib.loads(PAGE.split("```toml\n")[1].split("```")[0])["cells"][0]
    flat = {
        f"{part}.{name}": value for part, table in cell["behaviour"].items() for name, value in table.items()
    }
    assert BehaviourDistribution.of(cell["behaviour"]).as_dict().keys() == flat.keys() <= PARAMETERS.keys()
