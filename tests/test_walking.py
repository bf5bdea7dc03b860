"""Following a path, with a point mass in place of the physics."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.participants.walking import (
    CONTROL_TIMESTEP,
    follow,
    path_length,
    point_along,
    project,
    sidestep,
    turn_towards,
    wrap_angle,
)

coordinate = st.floats(-5, 5).map(lambda v: round(v, 3))
points = st.lists(st.tuples(coordinate, coordinate), min_size=2, max_size=6).map(np.array)


@given(st.floats(-50, 50))
def test_wrapping_keeps_the_direction(angle):
    wrapped = wrap_angle(angle)
    assert -np.pi <= wrapped < np.pi
    assert np.cos(wrapped) == pytest.approx(np.cos(angle), abs=1e-9)
    assert np.sin(wrapped) == pytest.approx(np.sin(angle), abs=1e-9)


@given(points, st.tuples(coordinate, coordinate).map(np.array))
def test_projection_is_the_nearest_of_many_points_along_the_path(path, position):
    arc, gap = project(path, position)
    dense = np.array([point_along(path, a) for a in np.linspace(0, path_length(path), 400)])
    nearest = np.linalg.norm(dense - position, axis=1).min()
    assert gap <= nearest + 1e-9
    assert np.linalg.norm(point_along(path, arc) - position) == pytest.approx(gap, abs=1e-6)


def test_turning_takes_the_short_way_round():
    rate, error = turn_towards(np.pi - 0.1, np.zeros(2), np.array([-1.0, -0.1]))
    assert rate > 0
    assert 0 < error < 0.3


@pytest.mark.parametrize(
    "path",
    [
        [(0, 0), (4, 0)],
        [(0, 0), (2, 0), (2, 2)],
        [(0, 0), (1, 0), (1, 1), (0.2, 1), (0.2, 0.5)],
        [(0, 0), (-3, 0.1)],
    ],
)
def test_a_point_mass_arrives_and_stays_near_the_path(path):
    path = np.array(path, dtype=float)
    position, heading, strayed = path[0].copy(), 0.0, 0.0
    for _ in range(1000):
        move = follow(path, position, heading)
        c, s = np.cos(heading), np.sin(heading)
        position = position + CONTROL_TIMESTEP * np.array(
            [c * move.forward - s * move.left, s * move.forward + c * move.left]
        )
        heading += CONTROL_TIMESTEP * move.turn
        strayed = max(strayed, project(path, position)[1])
        if np.linalg.norm(position - path[-1]) < 0.05:
            break
    else:
        pytest.fail(f"never arrived, stopped at {position}")
    assert strayed < 0.13


def anywhere(_point):
    return True


@pytest.mark.parametrize("across", [-0.3, -0.05, 0.0, 0.1, 0.35])
def test_things_on_the_way_are_walked_around(across):
    path, thing = np.array([[0.0, 0.0], [4.0, 0.0]]), np.array([2.0, across])
    position, heading, nearest = np.zeros(2), 0.0, np.inf
    for _ in range(400):
        move = follow(
            path, position, heading, around=lambda t, b, p=position: sidestep(p, t, b, [thing], anywhere)
        )
        c, s = np.cos(heading), np.sin(heading)
        position = position + CONTROL_TIMESTEP * np.array(
            [c * move.forward - s * move.left, s * move.forward + c * move.left]
        )
        heading += CONTROL_TIMESTEP * move.turn
        nearest = min(nearest, float(np.linalg.norm(position - thing)))
    assert nearest > 0.3
    assert np.linalg.norm(position - path[-1]) < 0.1


def test_a_thing_is_passed_on_its_free_side():
    thing, target = np.array([0.5, 0.1]), np.array([0.25, 0.0])
    assert sidestep(np.zeros(2), target, 4 * target, [thing], anywhere)[1] < 0
    assert sidestep(np.zeros(2), target, 4 * target, [thing], lambda p: p[1] > 0)[1] > 0
    assert sidestep(np.zeros(2), target, 4 * target, [thing], lambda _: False).tolist() == target.tolist()


@pytest.mark.parametrize("thing", [(-0.3, 0.0), (1.5, 0.0), (0.4, 0.6)])
def test_what_is_not_in_the_way_bends_nothing(thing):
    target = np.array([0.25, 0.0])
    assert sidestep(np.zeros(2), target, 4 * target, [np.array(thing)], anywhere).tolist() == target.tolist()
