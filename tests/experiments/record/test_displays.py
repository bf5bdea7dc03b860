"""What a log says about the picture that a person saw."""

import pytest

from experiments.record.metrics import displays
from experiments.trials.exclusions import Exclusions, Rule, left_out


def display(**changes):
    return {
        "event": "display",
        "draw": "browser",
        "renderer": "ANGLE (Intel)",
        "width": 1200,
        "height": 675,
        "pixel_ratio": 2.0,
        "frames_per_s": 60.0,
        "frame_ms": 16.7,
        "frame_ms_95": 17.5,
        "latency_ms": 30.0,
        "dropped": 0,
        **changes,
    }


def test_a_trial_that_nobody_watched_has_no_columns():
    assert displays([{"event": "start"}, {"event": "end"}]) == {}


def test_columns_are_medians_over_the_trial():
    slow = display(draw="server", renderer="frames", frames_per_s=10.0, latency_ms=None, dropped=100)
    found = displays([{"event": "start"}, display(), display(frames_per_s=50.0, latency_ms=50.0), slow])
    assert found["drawn_by_browser"] == pytest.approx(2 / 3)
    assert found["display_renderer"] == "ANGLE (Intel)" and found["display_width"] == 1200.0
    assert (found["display_frames_per_s"], found["display_latency_ms"]) == (50.0, 40.0)
    assert found["display_field_of_view"] is None
    chosen = displays([display(field_of_view=1.5), display(field_of_view=1.7), slow])
    assert chosen["display_field_of_view"] == pytest.approx(1.6)
    assert found["display_dropped"] == pytest.approx(100 / (5 * 120 + 100))


def test_people_can_be_left_out_by_what_they_saw(tmp_path):
    rows = [
        {
            "participant": name,
            "assistance": "none",
            "objects": 1,
            "ended": "all delivered",
            **displays([event]),
        }
        for name, event in (("seeing", display()), ("slow", display(frames_per_s=8.0)))
    ]
    rule = Rule("display_frames_per_s", "<", "saw too few pictures", 20)
    assert [person.person for person in left_out(Exclusions((rule,)), rows, tmp_path).values()] == ["slow"]
