"""The planner benchmark judges gaps against the best tour, and says where a planner found none."""

import pytest

from experiments.commands.bench import benchmark

MODULE = benchmark("planner")


LIVE = {
    "replans": 9, "proven": 8, "gap_mean": 0.25, "gap_max": 1.5, "wall_median": 0.02, "wall_p95": 0.045,
    "cpu_median": 0.01, "cpu_p95": 0.02, "proof_wall_median": 0.1, "proof_wall_p95": 0.6,
}  # fmt: skip


def record(planner, cost, seed=0, bound=None, cpu=1.0):
    return {
        "planner": planner, "objects": 24, "seed": seed, "state": "start", "left": 24, "cost": cost, "bound": bound,
        "proven": cost is not None and cost == bound, "wall": cpu, "cpu": cpu, "peak_mb": 100.0,
    }  # fmt: skip


def test_gaps_are_to_the_best_tour_of_each_problem():
    rows = MODULE.summary(
        [
            record("exact", 100.0, bound=100.0),
            record("exact", 210.0, seed=1, bound=189.0, cpu=3.0),
            record("other", 110.0),
            record("other", 200.0, seed=1),
        ]
    )
    exact, other = rows
    assert (exact["proven"], exact["best"], exact["problems"]) == (1, 1, 2)
    assert exact["gap_mean"] == pytest.approx(2.5) and exact["gap_max"] == pytest.approx(5.0)
    assert exact["bound_gap_max"] == pytest.approx(10.0)
    assert exact["cpu_median"] == 2.0 and exact["cpu_max"] == 3.0
    assert other["gap_mean"] == pytest.approx(5.0) and other["bound_gap_max"] is None


def test_a_planner_without_a_tour_is_reported_and_spoils_no_gap():
    rows = MODULE.summary(
        [record("exact", 100.0, bound=100.0), record("lost", None), record("lost", None, 1)]
    )
    assert [row["gap_mean"] for row in rows] == [0.0, None]
    result = {
        "houses": 2, "summary": rows, "not_installed": ["vroom"], "first_call": {"12": {"wall": 0.5, "cpu": 0.4}},
        "live": {"objects": 24, "houses": 1, "groups": {"all": LIVE}},
    }  # fmt: skip
    text = "\n".join(MODULE.lines(result))
    assert "2 failed" in text and "vroom: not installed" in text and "12 objects: 0.50 s" in text
    assert text.splitlines()[2].split("┃")[-2].strip() == "MB"  # no more columns than headings
    assert "9 replans; first plan 20 ms, 95 % within 45 ms" in text and "8 proven" in text
