"""Some of what `mjsim bench play` does to a server by the hundred and thousand."""

from benchmarks import play
from benchmarks.support.play_faults import FAULTS, measure_faults
from benchmarks.support.play_fuzz import measure_fuzz


def test_faults_lose_and_double_no_acknowledged_input(tmp_path):
    result = measure_faults(tmp_path / "visits", 10, 1, print, *play.FAST)
    assert not result["problems"] and result["tracebacks"] == 0
    assert set(result["resume_s"]) == set(FAULTS), "every kind of fault happened"
    text = "\n".join(play.lines({"load": 0.0, "faults": result}))
    assert "worker killed: " in text and "differ: 0 (<= 0: pass)" in text


def test_odd_messages_and_requests_are_refused_and_disturb_nobody(tmp_path):
    result = measure_fuzz(tmp_path / "visits", 300, 60, 2, *play.FAST)
    bad = ("server_down", "tracebacks", "tracebacks_logged", "server_errors", "bystander_cut_off")
    assert {name: result[name] for name in bad} == dict.fromkeys(bad, 0)
    assert {"malformed", "too early"} <= set(result["refusals"])
