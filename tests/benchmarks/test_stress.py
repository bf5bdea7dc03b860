"""Some sessions of `mjsim bench walking`, `carrying` and `placements`: they meet the benchmarks' requirements."""

import pytest

from benchmarks._command import benchmark
from benchmarks.support import carrying_sessions as carrying
from benchmarks.support import placement_sessions as placing
from benchmarks.support import walking_sessions as walking

pytestmark = pytest.mark.slow


def judged(name, results):
    """The figures of a benchmark, all of which meet its requirements."""
    module = benchmark(name)
    result = module.summarise(results)
    outcomes = list(module.lines(result))[-len(module.REQUIREMENTS) :]
    assert all("pass" in line for line in outcomes), outcomes
    return result


@pytest.mark.parametrize(
    "session", [2, 10]
)  # both ran into a gap too narrow for a person before it was closed
def test_running_into_things_neither_passes_nor_wedges(house, session):
    result = judged("walking", [walking.run_session(house, session)])
    assert result["overlap_max_mm"] > 1.0  # it did run into something
    assert result["retreats"] >= 5


def test_two_things_are_carried_through_the_house_at_full_speed(house):
    walks = [carrying.run_session(house, number) for number in range(3)]
    assert judged("carrying", walks)["arrived"] == len(walks)
    assert max(float(walk.speed.max()) for walk in walks) == pytest.approx(1.4, abs=0.05)


def test_everything_is_delivered_at_the_first_try(house):
    sessions = [placing.run_session(house, number) for number in range(6)]  # one for each receptacle
    found = [placement for session in sessions for placement in session]
    assert judged("placements", found)["placements"] == 6 * placing.LEVELS
    assert {p.receptacle for p in found} == set(house.receptacles)
    assert {p.fill for p in found} == set(range(placing.LEVELS))
