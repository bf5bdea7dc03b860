"""Section 6, the metrics: each test is a sentence of docs/paper.md, worked out anew from what was seen."""

import numpy as np
import pytest

from experiments.record.metrics import compute_metrics


def metrics_of(played):
    return compute_metrics(played.events, played.session.record.record().trajectory["position"])


@pytest.fixture(params=["followed", "own_way"])
def measured(request):
    played = request.getfixturevalue(request.param)
    positions = np.array([observation.position for observation, _ in played.shown])
    return played, positions, metrics_of(played)


def test_task_distance_is_what_was_walked(measured):
    _, positions, metrics = measured
    walked = np.linalg.norm(np.diff(positions, axis=0), axis=1).sum()
    assert metrics.task_distance_m == pytest.approx(walked, rel=0.01)


def test_normalized_deviations_count_visits_that_differ_from_the_replanned_next_one(measured):
    """The suggestion is read off the list that was shown before each visit."""
    played, _, metrics = measured
    labels = {o.name: o.model for o in played.world.scene.episode.objects}
    different = 0
    for event in played.of("visit"):
        before = [state for o, state in played.shown if o.time < event["t"] - 1e-6][-1]
        current = next(item for item in before.checklist if item.current)
        kind = "pick" if current.detail.startswith("Pick up") else "place"
        model = (current.picture or "").removeprefix("object:")
        different += (kind, model) != (event["kind"], labels[event["object"]])
    assert metrics.nd_strict_2n == pytest.approx(different / 12, abs=1e-9)


def test_inverse_path_length_is_the_distance_between_locations_over_what_was_walked(measured, house):
    """Locations: the start, where an object lay, where one stands at its bin; d is the geodesic."""
    played, positions, metrics = measured
    here = played.shown[0][0].position
    total = 0.0
    for event in played.of("visit"):
        if event["kind"] == "pick":
            place = played.lay(event)
        else:
            place = house.receptacles[played.world.scene.episode.targets[event["object"]]].approach
        total += house.geodesics.shortest_path(here, place).geodesic_distance
        here = place
    walked = np.linalg.norm(np.diff(positions, axis=0), axis=1).sum()
    assert metrics.ipl_locations == pytest.approx(total / walked, rel=0.05)


def test_deviations_rise_and_path_efficiency_falls_for_who_goes_an_own_way(followed, own_way):
    one, other = metrics_of(followed), metrics_of(own_way)
    assert one.nd_strict_2n < other.nd_strict_2n
    assert one.ipl_locations > other.ipl_locations or one.task_distance_m < other.task_distance_m
