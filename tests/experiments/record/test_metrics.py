"""The metrics on logs that can be worked out by hand."""

import numpy as np
import pytest

from experiments.record.columns import HEALTH
from experiments.record.metrics import compute_metrics, measure

DEFAULTS = {"deviated": False, "alternatives": 1, "tied_alternatives": 0, "tied": False}


def visit(t=1.0, *, geodesic=1.0, location=1.0, **fields):
    lengths = {"geodesic_m": geodesic, "location_m": location}
    return {"t": t, "event": "visit", **DEFAULTS, **lengths, **fields}


def log(*events, end=20.0, reason="all delivered", objects=6):
    return [
        {"t": 0.0, "event": "start", "objects": objects},
        {"t": 0.0, "event": "plan", "cost_m": 3.0, "reach_bound_m": 1.0},
        *events,
        {"t": end, "event": "end", "reason": reason},
    ]


STRAIGHT = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]])


def measured(*events, **options):
    return compute_metrics(log(*events, **options), STRAIGHT)


def test_walking_the_geodesics_gives_an_inverse_path_length_of_one():
    metrics = measured(visit(1, geodesic=3.0), visit(2, geodesic=4.0))
    assert metrics.task_distance_m == 7.0
    assert metrics.ipl_stand == 1.0


def test_who_reaches_walks_less_than_from_place_to_place():
    metrics = measured(visit(geodesic=5.0, location=8.4), visit(geodesic=1.0, location=1.4))
    assert metrics.ipl_stand == pytest.approx(6 / 7)
    assert metrics.ipl_locations == pytest.approx(9.8 / 7)


CHOICES = [
    visit(1, deviated=True, alternatives=3),
    visit(2, alternatives=2),
    visit(3, alternatives=1),
    visit(4, alternatives=0),
]


def test_deviations_over_all_visits_of_the_task_and_over_those_with_a_choice():
    metrics = measured(*CHOICES, objects=2)
    assert metrics.nd_strict_2n == pytest.approx(1 / 4)
    assert metrics.nd_feasible == pytest.approx(1 / 3)
    assert measured(CHOICES[0], objects=6).nd_strict_2n == pytest.approx(1 / 12), "also of an unfinished task"
    nothing = measured(visit(alternatives=0))
    assert (nothing.nd_feasible, nothing.nd_bin_tied, nothing.nd_strict_2n) == (0.0, 0.0, 0.0)


def test_who_makes_no_visit_has_neither_the_best_score_nor_any():
    metrics = measured(end=60.0, reason="time limit")
    scores = ("nd_strict_2n", "nd_feasible", "nd_bin_tied", "nd_regret_10cm", "ipl_locations", "ipl_stand")
    assert metrics.visits == 0
    assert [getattr(metrics, name) for name in scores] == [None] * 6


def test_the_order_within_a_bin_is_forgiven_and_no_choice():
    tied = {"deviated": True, "tied": True, "tied_alternatives": 1}
    only_tied = visit(1, **tied, alternatives=1)  # hands full of two things for one bin
    also_tied = visit(2, **tied, alternatives=2)
    elsewhere = visit(3, deviated=True, alternatives=2, tied_alternatives=1)
    metrics = measured(only_tied, also_tied, elsewhere, visit(4))
    assert metrics.nd_feasible == pytest.approx(3 / 4)
    assert metrics.nd_bin_tied == pytest.approx(1 / 3)


def test_a_cheap_deviation_is_forgiven_where_regret_counts():
    regrets = [(True, 0.1), (True, 0.11), (False, 0.0), (True, None)]
    metrics = measured(*(visit(k, deviated=d, regret_m=m) for k, (d, m) in enumerate(regrets)))
    assert metrics.nd_feasible == pytest.approx(3 / 4)
    assert metrics.nd_regret_10cm == pytest.approx(1 / 3)
    assert measured(visit(deviated=True)).nd_regret_10cm is None


def test_regrets_add_up_and_a_tie_is_no_mistake():
    metrics = measured(*(visit(t, regret_m=m) for t, m in ((1, 0.0), (2, 0.004), (3, 2.5), (4, None))))
    assert metrics.total_regret_m == pytest.approx(2.504)
    assert metrics.mean_regret_m == pytest.approx(2.504 / 3)
    assert (metrics.regretful_visits, metrics.unjudged_visits) == (1, 1)


def test_regrets_that_came_later_count_for_their_visits():
    later = {"t": 9.0, "event": "regret", "visit": 1, "regret_m": 0.7, "suggested_regret_m": 0.2}
    metrics = measured(visit(1, regret_m=0.0, suggested_regret_m=0.0), visit(2), later)
    assert (metrics.total_regret_m, metrics.unjudged_visits) == (0.7, 0)
    assert (metrics.mean_suggestion_gap_m, metrics.max_suggestion_gap_m) == (0.1, 0.2)


def test_where_nobody_judged_there_is_no_regret_to_speak_of():
    metrics = measured(visit(1), visit(2))
    assert (metrics.mean_regret_m, metrics.total_regret_m) == (None, None)
    assert (metrics.mean_suggestion_gap_m, metrics.max_suggestion_gap_m) == (None, None)
    assert (metrics.regretful_visits, metrics.unjudged_visits) == (None, 2)


def test_completion_time_over_the_own_familiarisation():
    metrics = measured(
        {"t": 0.0, "event": "phase_ended", "phase": "flythrough", "duration_s": 80.0}, end=20.0
    )
    assert metrics.completion_over_familiarisation == 0.25


def test_completion_time_is_that_of_the_last_delivery_or_of_the_end():
    placed = [{"t": t, "event": "placed"} for t in (5.0, 11.5)]
    whole = measured(*placed, end=11.5)
    assert (whole.completion_time_s, whole.delivered) == (11.5, 2)
    assert whole.completion_over_familiarisation is None
    unfinished = measured(placed[0], end=60.0, reason="time limit")
    assert (unfinished.completion_time_s, unfinished.ended) == (60.0, "time limit")


def test_refusals_replans_and_failures_are_counted_and_what_falls_out_again_is_not_delivered():
    metrics = measured(
        {"t": 1.0, "event": "attempt", "applied": False},
        {"t": 2.0, "event": "attempt", "applied": True},
        {"t": 3.0, "event": "pick_failed"},
        {"t": 4.0, "event": "grip_lost"},
        {"t": 5.0, "event": "plan", "cost_m": 9.0},
        {"t": 6.0, "event": "placed"},
        {"t": 7.0, "event": "dislodged"},
    )
    assert (metrics.refusals, metrics.replans, metrics.failures, metrics.delivered) == (1, 1, 2, 0)
    assert (metrics.planned_distance_m, metrics.reach_bound_m) == (3.0, 1.0)


def test_the_columns_of_a_run_name_its_settings_its_person_and_the_model_of_the_participant():
    start = {
        "t": 0.0,
        "event": "start",
        "objects": 2,
        "user": "guest",
        "seed": 3,
        "format": 1,
        "order": ["b", "a"],
    }
    person = {"reach": 0.9, "eye_height": 1.7, "motion": {"lead": 0.2}}
    told = {"t": 0.0, "event": "participant", "person": person, "behaviour": {"noise.scale": 0.3}}
    lost = {"t": 2.0, "event": "grip_lost", "object": "a", "receptacle": None}
    end = {"t": 4.0, "event": "end", "reason": "interrupted", "signal": "SIGTERM"}
    arrays = {name: np.array([0.0, 0.1, 0.2]) for name in HEALTH}
    arrays |= {
        "position": STRAIGHT,
        "time": np.array([0.0, 2.0, 4.0]),
        "settle_s": np.array([np.nan, 0.5, np.nan]),
    }
    found = measure([start, told, lost, end], arrays)
    expected = {
        **{
            "objects": 2,
            "user": "guest",
            "seed": 3,
            "simulated": True,
            "simulated_s": 4.0,
            "signal": "SIGTERM",
        },
        **{
            "person_reach": 0.9,
            "person_eye_height": 1.7,
            "behaviour_noise_scale": 0.3,
            "ended": "interrupted",
        },
        **{
            "grips_lost": 1,
            "ejections": 0,
            "releases_settled": 1,
            "max_settle_s": 0.5,
            "max_penetration_m": 0.2,
        },
    }
    assert {name: found[name] for name in expected} == expected
    assert found["p99_penetration_m"] == pytest.approx(0.198)
    assert not {"format", "order", "t", "event", "person_motion", "error"} & set(found)
    assert not [name for name in measure([start, end], arrays) if name.startswith(("person_", "behaviour_"))]
