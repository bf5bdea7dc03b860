"""Following a path, with a point mass in place of the physics, and the kernels against formulas in NumPy."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely import LineString, Point

from mjsim.values.motion_parameters import WalkingParameters
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.walking.path_following import (
    Obstacles,
    Pace,
    follow,
    is_free,
    sidestep,
    turn_towards,
    wrap_angle,
)
from mjsim.world.walking.polyline import first_off_path, path_length, point_along, project, rest_of
from planner.navmesh import NavMesh

CONTROL_TIMESTEP = 0.04
PATIENT = settings(deadline=None)  # the first case compiles
coordinate = st.floats(-5, 5).map(lambda v: round(v, 3))
spots = st.tuples(coordinate, coordinate)
points = st.lists(spots, min_size=2, max_size=6).map(np.array)
PACE = Pace.of(PersonParameters())
walkers = st.builds(
    WalkingParameters,
    look_ahead=st.floats(0.1, 0.6),
    look_beyond=st.floats(1.0, 2.0),
    sidestep_range=st.floats(0.3, 0.9),
    object_clearance=st.floats(0.1, 0.3),
    sidestep_room=st.floats(0.1, 2.0),
    braking_share=st.floats(0.2, 1.0),
    turn_gain=st.floats(1.0, 10.0),
    facing_tolerance=st.just(0.25),
    least_progress=st.just(0.05),
)
NOTHING = Obstacles(np.zeros((0, 3)), np.zeros(0, bool), -1, np.zeros((0, 4)))


def floor_of(*obstacles):
    return NavMesh.build(obstacles, (-10.0, -10.0, 10.0, 10.0)).outline


ANYWHERE = floor_of()


def among(walls, *objects):
    positions = np.array([(x, y, 0.0) for x, y in objects]).reshape(-1, 3)
    return Obstacles(positions, np.ones(len(objects), bool), -1, walls)


def moved(position, heading, move):
    forward, left, turn = move
    c, s = np.cos(heading), np.sin(heading)
    step = np.array([c * forward - s * left, s * forward + c * left])
    return position + CONTROL_TIMESTEP * step, heading + CONTROL_TIMESTEP * turn


@PATIENT
@given(st.floats(-50, 50))
def test_wrapping_keeps_the_direction(angle):
    wrapped = wrap_angle(angle)
    assert -np.pi <= wrapped < np.pi
    assert np.cos(wrapped) == pytest.approx(np.cos(angle), abs=1e-9)
    assert np.sin(wrapped) == pytest.approx(np.sin(angle), abs=1e-9)


@PATIENT
@given(points, spots, st.floats(0, 60))
def test_lengths_projections_and_points_are_those_of_shapely(path, position, along):
    line = LineString(path)
    assert path_length(path) == pytest.approx(line.length)
    assert point_along(path, along) == pytest.approx(line.interpolate(along).coords[0], abs=1e-9)
    arc, gap = project(path, *position)
    assert gap == pytest.approx(line.distance(Point(position)), abs=1e-9)
    assert math.dist(line.interpolate(arc).coords[0], position) == pytest.approx(gap, abs=1e-6)


def test_turning_takes_the_short_way_round():
    rate, error = turn_towards(np.pi - 0.1, 0.0, 0.0, -1.0, -0.1, PACE)
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
        position, heading = moved(position, heading, follow(path, *position, heading, NOTHING, PACE))
        strayed = max(strayed, project(path, *position)[1])
        if np.linalg.norm(position - path[-1]) < 0.05:
            break
    else:
        pytest.fail(f"never arrived, stopped at {position}")
    assert strayed < 0.13


@pytest.mark.parametrize("across", [-0.3, -0.05, 0.0, 0.1, 0.35])
def test_things_on_the_way_are_walked_around(across):
    path, thing = np.array([[0.0, 0.0], [4.0, 0.0]]), np.array([2.0, across])
    position, heading, nearest = np.zeros(2), 0.0, np.inf
    for _ in range(400):
        position, heading = moved(
            position, heading, follow(path, *position, heading, among(ANYWHERE, thing), PACE)
        )
        nearest = min(nearest, float(np.linalg.norm(position - thing)))
    assert nearest > 0.3
    assert np.linalg.norm(position - path[-1]) < 0.1


def test_a_thing_is_passed_on_its_free_side():
    target, beyond = (0.25, 0.0), (1.0, 0.0)
    south, north = floor_of(_box(-9, -9, 9, -0.2)), floor_of(_box(-9, -9, 9, -0.2), _box(-9, 0.2, 9, 9))
    assert sidestep(0.0, 0.0, target, beyond, among(ANYWHERE, (0.5, 0.1)), PACE)[1] < 0
    assert sidestep(0.0, 0.0, target, beyond, among(south, (0.5, 0.1)), PACE)[1] > 0
    assert sidestep(0.0, 0.0, target, beyond, among(north, (0.5, 0.1)), PACE) == target


@pytest.mark.parametrize("thing", [(-0.3, 0.0), (1.5, 0.0), (0.4, 0.6)])
def test_what_is_not_in_the_way_bends_nothing(thing):
    target = (0.25, 0.0)
    assert sidestep(0.0, 0.0, target, (1.0, 0.0), among(ANYWHERE, thing), PACE) == target


def test_what_is_sought_or_put_away_bends_nothing():
    target, obstacles = (0.25, 0.0), among(ANYWHERE, (0.4, 0.0))
    assert sidestep(0.0, 0.0, target, (1.0, 0.0), obstacles, PACE) != target
    for ignored in ({"is_loose": np.array([False])}, {"target": 0}):
        assert sidestep(0.0, 0.0, target, (1.0, 0.0), obstacles._replace(**ignored), PACE) == target


def _box(x0, y0, x1, y1):
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=float)


# The same in NumPy, written down independently of the kernels.


def sidestep_in_numpy(position, target, beyond, things, is_free, person):
    clearance = person.body_radius + person.walking.object_clearance
    reach = np.linalg.norm(beyond - position)
    if reach < 1e-9:
        return target
    ahead = (beyond - position) / reach
    left = np.array([-ahead[1], ahead[0]])
    offsets = [thing - position for thing in things]
    in_the_way = [
        (r @ ahead, r @ left)
        for r in offsets
        if 0.0 < r @ ahead < person.walking.sidestep_range and abs(r @ left) < clearance
    ]
    if not in_the_way:
        return target
    along, across = min(in_the_way)
    side = -1.0 if across >= 0 else 1.0
    for sign in (side, -side):
        if sign == -side and along < person.walking.sidestep_room * abs(across + sign * clearance):
            return target
        step = along * ahead + (across + sign * clearance) * left
        aside = position + step * (np.linalg.norm(target - position) / np.linalg.norm(step))
        if is_free(position + step) and is_free(aside):
            return aside
    return target


def follow_in_numpy(path, position, heading, things, is_free, person):
    walking, line = person.walking, LineString(path)
    arc, gap = project(path, *position)
    beyond, target = (
        np.array(line.interpolate(arc + far).coords[0]) for far in (walking.look_beyond, walking.look_ahead)
    )
    target = sidestep_in_numpy(position, target, beyond, things, is_free, person)
    offset = target - position
    assume(np.linalg.norm(offset) > 1e-6)
    error = (np.arctan2(offset[1], offset[0]) - heading + np.pi) % (2 * np.pi) - np.pi
    assume(abs(error) < np.pi - 1e-6)  # straight behind, rounding says which way to turn
    braking = walking.braking_share * person.walking_acceleration
    pace = min(person.walking_speed, np.sqrt(2 * braking * (line.length - arc + gap)))
    pace *= max(np.cos(error), 0.0) ** 2
    turn = np.clip(walking.turn_gain * error, -person.turning_speed, person.turning_speed)
    return pace * np.cos(error), pace * np.sin(error), turn


@PATIENT
@given(points, spots, st.floats(-7, 7), st.lists(spots, max_size=4), walkers)
def test_following_agrees_with_numpy(path, position, heading, things, walking):
    # Nothing is exactly at the limits of being in the way.
    things = [(x + 0.000123, y + 0.000217) for x, y in things]
    there, person = np.array(position), PersonParameters(walking=walking)
    walls = NavMesh.build([_box(-1, -1, 1, 0.5), _box(2, -3, 3, 3)], (-6.0, -6.0, 6.0, 6.0))
    ours = follow(path, *position, heading, among(walls.outline, *things), Pace.of(person))
    theirs = follow_in_numpy(path, there, heading, np.array(things), walls.is_navigable, person)
    assert ours == pytest.approx(theirs, abs=1e-6)


@PATIENT
@given(points, spots)
def test_the_rest_of_a_path_is_what_lies_ahead(path, position):
    arc, _ = project(path, *position)
    rest = rest_of(path, *position)
    assert path_length(rest) == pytest.approx(path_length(path) - arc, abs=1e-8)
    assert rest[-1].tolist() == path[-1].tolist()
    for share in (0.0, 0.3, 1.0):
        ahead = share * path_length(rest)
        assert point_along(rest, ahead) == pytest.approx(point_along(path, arc + ahead), abs=1e-7)


@PATIENT
@given(points, st.lists(spots, min_size=1, max_size=8).map(np.array), st.floats(0.1, 3.0))
def test_the_first_off_path_is_the_first_far_from_the_path(path, positions, gap):
    far = [k for k, (x, y) in enumerate(positions) if project(path, x, y)[1] > gap]
    assert first_off_path(path, positions, 0, gap) == (far[0] if far else -1)
    assert first_off_path(path, positions, len(positions), gap) == -1


def test_the_outline_says_where_one_can_stand(navmesh):
    walls = navmesh.outline
    x_min, y_min, x_max, y_max = navmesh.bounds
    sampled = np.random.default_rng(0).uniform((x_min, y_min), (x_max, y_max), (2000, 2))
    free = [is_free(x, y, walls) for x, y in sampled]
    assert free == [navmesh.is_navigable(point) for point in sampled]
    assert 200 < sum(free) < 1800
