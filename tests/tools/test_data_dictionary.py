"""The data dictionary describes the fields that are written, and no others."""

import dataclasses
import re

import pytest

from experiments.record import records
from experiments.record.events import check_event
from experiments.record.files import read_json
from experiments.record.metrics import Displays
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from tools.data_dictionary import data_dictionary


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    out = tmp_path_factory.mktemp("data") / "run"
    run_trial(
        TrialConfig(objects=6, assistance="none", seed=3, time_limit=30.0, fidelity="event"),
        out,
        topdown=False,
    )
    return out


def test_every_row_of_the_metrics_is_described_and_no_other(run):
    section = data_dictionary().split("## metrics.json")[1].split("\n## ")[0]
    described = re.findall(r"^\| (`.*?`(?:, `.*?`)*) \|", section, flags=re.M)
    names = [name for cell in described for name in re.findall(r"`(\w+)`", cell)]
    assert len(names) == len(set(names))
    sometimes = {"signal", "error", *(field.name for field in dataclasses.fields(Displays))}
    assert sometimes <= set(names) and set(names) - sometimes == set(read_json(run / records.METRICS))


def test_every_event_of_a_run_has_its_type(run):
    lines = (run / records.EVENTS).read_bytes().splitlines()
    assert {b'"visit"', b'"attempt"', b'"plan"'} <= {
        line.split(b'"event": ')[1].split(b",")[0] for line in lines
    }
    for line in lines:
        check_event(line)
