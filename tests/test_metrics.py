"""The paper's metrics on logs that can be worked out by hand."""

import numpy as np
import pytest

from experiments.metrics import compute_metrics


def visit(t, *, deviated=False, alternatives=1, geodesic=1.0):
    return {
        "t": t,
        "event": "visit",
        "deviated": deviated,
        "alternatives": alternatives,
        "geodesic_m": geodesic,
    }


def log(*events, end=20.0, reason="all delivered"):
    return [{"t": 0.0, "event": "plan", "cost_m": 3.0}, *events, {"t": end, "event": "end", "reason": reason}]


STRAIGHT = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]])


def test_walking_the_geodesics_gives_an_inverse_path_length_of_one():
    metrics = compute_metrics(log(visit(1, geodesic=3.0), visit(2, geodesic=4.0)), STRAIGHT)
    assert metrics.task_distance_m == 7.0
    assert metrics.inverse_path_length == 1.0


def test_a_detour_lowers_the_inverse_path_length():
    metrics = compute_metrics(log(visit(1, geodesic=5.0)), STRAIGHT)
    assert metrics.inverse_path_length == pytest.approx(5 / 7)


def test_only_visits_with_a_choice_count_as_possible_deviations():
    events = [
        visit(1, deviated=True, alternatives=3),
        visit(2, alternatives=2),
        visit(3, alternatives=1),
        visit(4, alternatives=0),
    ]
    assert compute_metrics(log(*events), STRAIGHT).normalized_deviations == pytest.approx(1 / 3)


def test_without_any_choice_there_are_no_deviations():
    assert compute_metrics(log(visit(1, alternatives=0)), STRAIGHT).normalized_deviations == 0.0


def test_regrets_add_up_and_a_tie_is_no_mistake():
    visits = [{**visit(t), "regret_m": m} for t, m in ((1, 0.0), (2, 0.004), (3, 2.5), (4, None))]
    metrics = compute_metrics(log(*visits), STRAIGHT)
    assert metrics.total_regret_m == pytest.approx(2.504)
    assert metrics.mean_regret_m == pytest.approx(2.504 / 3)
    assert (metrics.regretful_visits, metrics.unjudged_visits) == (1, 1)


def test_regrets_that_came_later_count_for_their_visits():
    later = {"t": 9.0, "event": "regret", "visit": 1, "regret_m": 0.7}
    metrics = compute_metrics(log({**visit(1), "regret_m": 0.0}, visit(2), later), STRAIGHT)
    assert (metrics.total_regret_m, metrics.unjudged_visits) == (0.7, 0)


def test_where_nobody_judged_there_is_no_regret_to_speak_of():
    metrics = compute_metrics(log(visit(1), visit(2)), STRAIGHT)
    assert (metrics.mean_regret_m, metrics.total_regret_m) == (None, None)
    assert (metrics.regretful_visits, metrics.unjudged_visits) == (0, 2)


def test_completion_time_is_that_of_the_last_delivery():
    placed = [{"t": t, "event": "placed"} for t in (5.0, 11.5)]
    metrics = compute_metrics(log(*placed, end=11.5), STRAIGHT)
    assert (metrics.completion_time_s, metrics.delivered) == (11.5, 2)


def test_an_unfinished_trial_takes_until_its_end():
    metrics = compute_metrics(log({"t": 5.0, "event": "placed"}, end=60.0, reason="time limit"), STRAIGHT)
    assert metrics.completion_time_s == 60.0


def test_an_object_that_falls_out_again_is_not_delivered():
    events = [{"t": 1.0, "event": "placed"}, {"t": 2.0, "event": "dislodged"}]
    assert compute_metrics(log(*events), STRAIGHT).delivered == 0


def test_refusals_replans_and_failures_are_counted():
    events = [
        {"t": 1.0, "event": "attempt", "applied": False},
        {"t": 2.0, "event": "attempt", "applied": True},
        {"t": 3.0, "event": "pick_failed"},
        {"t": 4.0, "event": "grip_lost"},
        {"t": 5.0, "event": "plan", "cost_m": 9.0},
    ]
    metrics = compute_metrics(log(*events), STRAIGHT)
    assert (metrics.refusals, metrics.replans, metrics.failures) == (1, 1, 2)
    assert metrics.optimal_distance_m == 3.0
