"""The placement benchmark: a sample of it, what it repeats, and what it requires."""

import numpy as np
import pytest

from benchmarks.support.placement_sessions import LEVELS, Placement, make_episode, run_session
from experiments.commands.bench import benchmark
from experiments.house import House

SESSIONS = 12  # two per receptacle
MODULE = benchmark("placements")


@pytest.fixture(scope="module")
def house() -> House:
    return House.load()


@pytest.fixture(scope="module")
def placements(house: House) -> list[Placement]:
    return [placement for number in range(SESSIONS) for placement in run_session(house, number)]


def test_everything_is_delivered_at_the_first_try_and_the_physics_stays_well(
    placements: list[Placement],
) -> None:
    assert len(placements) == SESSIONS * LEVELS
    assert [(p.session, p.model, p.outcome) for p in placements if p.outcome != "placed"] == []
    assert {p.receptacle for p in placements} == set(House.load().receptacles)
    assert {p.fill for p in placements} == set(range(LEVELS))
    result = MODULE.summarise(placements)
    outcomes = list(MODULE.lines(result))[-len(MODULE.REQUIREMENTS) :]
    assert all("pass" in line for line in outcomes), outcomes
    assert result["placements"] == sum(row["placements"] for row in result["by_fill"])


def test_a_session_repeats_to_the_last_bit(house: House, placements: list[Placement]) -> None:
    number = SESSIONS - 1
    for first, again in zip(placements[-LEVELS:], run_session(house, number), strict=True):
        assert (first.model, first.outcome, first.settle_s) == (again.model, again.outcome, again.settle_s)
        assert np.array_equal(first.penetration, again.penetration)


def test_sessions_differ_and_stand_where_a_person_can(house: House) -> None:
    episodes = [make_episode(house, number) for number in range(0, 60, 6)]
    stands = {(e.start.x, e.start.y) for e in episodes}
    assert len(stands) == len(episodes)
    for e in episodes:
        assert house.navmesh.is_navigable((e.start.x, e.start.y))
        for o in e.objects:
            assert np.hypot(o.point[0] - e.start.x, o.point[1] - e.start.y) < 1.0


def test_failures_count_against_the_requirements() -> None:
    good = Placement(0, "mug", "dish_bin", 0, "placed", 0, 0, 0.04, 0.001, 0.01, np.full(60, 1e-4))
    bad = [
        Placement(7, "mug", "dish_bin", 1, "place_failed", 1, 1, 0.0, 0.001, 0.01, np.full(60, 0.011)),
        Placement(8, "mug", "dish_bin", 1, "dislodged", 0, 0, 0.04, 0.001, 0.01, np.full(60, 1e-4)),
        Placement(9, "mug", "dish_bin", 1, "error", 0, 0, 0.0, 0.0, 0.0, np.zeros(0)),
        Placement(9, "mug", "dish_bin", 2, "pick_failed", 0, 0, 0.0, 0.0, 0.0, np.zeros(0)),
    ]
    result = MODULE.summarise([good] * 7 + bad)
    assert result["delivered_percent"] == pytest.approx(70.0)  # a failed pick is no placement
    assert (result["errors"], result["ejections"], result["tunnellings"]) == (1, 1, 1)
    text = list(MODULE.lines(result))
    assert sum("FAIL" in line for line in text) == len(MODULE.REQUIREMENTS)
    assert "failed: place_failed of mug with 1 before it; --only 7 runs it again" in text
