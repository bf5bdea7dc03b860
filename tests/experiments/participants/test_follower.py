"""One participant for all conditions: it behaves as the one that makes the most of what is shown."""

import numpy as np
import pytest
from sessions import prepared

from experiments.participants.registry import DEFAULT_PARTICIPANT
from experiments.trials.trial_config import TrialConfig


def played(house, **options):
    """State hashes and log of a trial, without the two events that name the participant."""
    config = TrialConfig(**{"objects": 3, "seed": 2, "fidelity": "event", "regret": False, **options})
    session, world, log = prepared(house, config)
    session.run()
    record = session.record.record()
    return record.recording["state_hash"].tolist(), log.events[2:], world, record.trajectory


@pytest.mark.slow
@pytest.mark.parametrize(
    ("assistance", "user"), [("none", "searcher"), ("highlight", "nearest"), ("none-minimap", "searcher")]
)
def test_it_does_as_well_as_the_specialist_to_the_bit(house, assistance, user):
    assert played(house, assistance=assistance)[:2] == played(house, assistance=assistance, user=user)[:2]


def test_it_is_the_default():
    assert TrialConfig(objects=6, assistance="none", seed=0).user == DEFAULT_PARTICIPANT == "follower"


@pytest.mark.slow
@pytest.mark.parametrize("assistance", ["none", "highlight", "optimal"])
@pytest.mark.parametrize("fidelity", ["event", "full"])
def test_one_hand_carries_one_object(house, assistance, fidelity):
    """Physics, planner and participant agree: the left hand stays empty, and no attempt is refused for full hands."""
    options = {"assistance": assistance, "fidelity": fidelity, "capacity": 1, "objects": 2}
    _, events, world, arrays = played(house, **options, time_limit=300.0)
    assert events[-1]["reason"] == "all delivered"
    assert (arrays["hands"][:, 0] == -1).all() and (arrays["hands"][:, 1] >= 0).any()
    assert not [e for e in events if e["event"] == "attempt" and e["refusal"] == "hands_full"]
    plan = next(event for event in events if event["event"] == "plan")
    assert [kind for kind, _ in plan["visits"]] == ["pick", "place"] * 2
    assert np.count_nonzero(arrays["object_status"][-1] == 2) == 2
    assert world.options.capacity == 1


def test_who_looks_down_at_a_bin_looks_up_again_for_flagpoles(house):
    """After placing, the gaze is on the bin; the poles of what is left are far away and far above it."""
    assert played(house, assistance="highlight", seed=0)[1][-1]["reason"] == "all delivered"
