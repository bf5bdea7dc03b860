"""Some commands killed and begun again, as `mjsim bench faults` does with hundreds."""

import os
import signal

import pytest

from benchmarks import faults
from experiments.replaying.replay import replay
from experiments.runs import records, run_directory, topdown
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from mjsim.files import remove_leftovers

CONFIG = TrialConfig(objects=2, assistance="optimal", seed=0, fidelity="event", regret=False)


def test_killed_commands_end_up_with_the_files_of_undisturbed_ones():
    result = faults.measure(kills=2)
    assert result["kills"] == 2 == sum(result["signals"].values())
    assert [result[r.key] for r in faults.REQUIREMENTS] == [0] * len(faults.REQUIREMENTS), result["faults"]
    text = "\n".join(faults.lines(result))
    assert "2 kills" in text and "FAIL" not in text


@pytest.mark.parametrize("after", [False, True], ids=["before", "after"])
@pytest.mark.parametrize("step", ["_link", "write_checksums", "exchange"])
def test_a_run_killed_at_its_floor_plan_has_it_whole_or_not_at_all(step, after, house, tmp_path, monkeypatch):
    """At each step by which the picture comes to the record; what draws it is not needed for that."""
    monkeypatch.setattr(topdown, "draw_topdown", lambda path, *_: path.write_bytes(b"picture"))
    monkeypatch.setattr(run_directory, step, killed(getattr(run_directory, step), after=after))
    child = os.fork()
    if child == 0:
        try:
            run_trial(CONFIG, tmp_path / "out", house=house)
        finally:
            os._exit(1)
    _, status = os.waitpid(child, 0)
    assert os.WTERMSIG(status) == signal.SIGKILL
    assert replay(tmp_path / "out", house=house).ended == "all delivered"
    assert (tmp_path / "out" / records.TOPDOWN).exists() == (after and step == "exchange")
    remove_leftovers(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def killed(function, *, after):
    """The function, killed before or after it does its work."""

    def call(*args):
        if after:
            function(*args)
        os.kill(os.getpid(), signal.SIGKILL)

    return call
