"""Compare navigability, islands, snapping and sampling of the navmesh with independent geometry."""

import math

import numpy as np
import pytest
import scipy.ndimage
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.errors import NavMeshError, NotNavigableError
from planner.navmesh import TOLERANCE, NavMesh

RADIUS = 0.25
# GEOS decides wrongly about points next to subnormal coordinates.
coordinate = st.floats(0.0, 4.0, allow_subnormal=False)
triangles = st.lists(st.tuples(coordinate, coordinate), min_size=3, max_size=5)
fields = st.lists(triangles, max_size=5)
BOUNDS = (0.0, 0.0, 4.0, 4.0)


def box(x0, y0, x1, y1):
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=float)


def distance_to_segment(p, a, b):
    ab = b - a
    length2 = float(ab @ ab)
    t = 0.0 if length2 == 0 else min(1.0, max(0.0, float((p - a) @ ab) / length2))
    return float(np.linalg.norm(p - a - t * ab))


def test_area_is_what_is_left_of_the_floor():
    mesh = NavMesh.build([box(1, 1, 2, 3)], BOUNDS, agent_radius=RADIUS)
    inflated = 1 * 2 + 2 * (1 + 2) * RADIUS + math.pi * RADIUS**2
    assert mesh.area == pytest.approx(16 - inflated, rel=1e-3)
    assert (mesh.topdown_map == 0).sum() * mesh.resolution**2 == pytest.approx(mesh.area, rel=0.01)


def test_a_closed_room_is_an_island_of_its_own():
    ring = [box(1, 1, 3, 1.05), box(1, 2.95, 3, 3), box(1, 1, 1.05, 3), box(2.95, 1, 3, 3)]
    mesh = NavMesh.build(ring, BOUNDS)
    assert len(mesh.islands) == 2
    assert mesh.island_of((0.3, 0.3)) == 0
    assert mesh.island_of((2.0, 2.0)) == 1
    assert mesh.island_of((1.0, 2.0)) is None
    assert mesh.area == mesh.islands[0].area > mesh.islands[1].area
    labels, count = scipy.ndimage.label(mesh.topdown_map >= 0)
    assert count == 2
    for label in (1, 2):
        assert len(set(mesh.topdown_map[labels == label])) == 1
    # By default, snapping leads out of the closet to the main island.
    out = mesh.snap((2.0, 2.0), max_distance=5.0)
    assert mesh.island_of(out) == 0
    assert np.array_equal(mesh.snap((2.0, 2.0), island=1), (2.0, 2.0))


def test_a_doorway_wider_than_the_person_joins_two_rooms_and_a_narrower_one_does_not():
    for gap, islands in ((2 * RADIUS + 0.01, 1), (2 * RADIUS - 0.01, 2)):
        wall = [box(1.9, 0, 2.0, 2 - gap / 2), box(1.9, 2 + gap / 2, 2.0, 4)]
        assert len(NavMesh.build(wall, BOUNDS, agent_radius=RADIUS).islands) == islands


def test_snap_is_the_nearest_point_of_a_face():
    mesh = NavMesh.build([box(1, 1, 2, 3)], BOUNDS, agent_radius=RADIUS)
    np.testing.assert_allclose(mesh.snap((1.9, 2.0)), (2 + RADIUS, 2.0), atol=2e-6)
    np.testing.assert_allclose(mesh.snap((4.5, 2.0)), (4.0, 2.0), atol=2e-6)
    with pytest.raises(NotNavigableError, match=r"\(1\.900, 2\.000\)"):
        mesh.snap((1.9, 2.0), max_distance=0.3)
    assert np.array_equal(mesh.snap((3.0, 0.5)), (3.0, 0.5))


@settings(max_examples=60, deadline=None)
@given(field=fields, point=st.tuples(st.floats(-1, 5), st.floats(-1, 5)))
def test_nothing_navigable_is_nearer_than_the_snapped_point(field, point):
    mesh = NavMesh.build(field, BOUNDS, agent_radius=0.2, resolution=0.1)
    snapped = mesh.snap(point, max_distance=math.inf)
    assert mesh.island_of(snapped) == 0
    centres = mesh.cell_centres[mesh.topdown_map == 0]
    if len(centres):
        nearest = np.hypot(*(centres - point).T).min()
        assert math.dist(snapped, point) <= nearest + 2e-4


def island_by_polygons(mesh, points):
    """Return the island of each point (m, 2), and which points are too close to an edge to decide."""
    with np.errstate(divide="ignore"):  # GEOS divides by zero if a point is almost on an edge
        gaps = shapely.distance(np.array(mesh.islands)[:, None], shapely.points(points)[None])
    near = gaps < 0.5 * TOLERANCE
    return np.where(near.any(axis=0), near.argmax(axis=0), -1), (abs(gaps - 0.5 * TOLERANCE) < 4e-5).any(
        axis=0
    )


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(field=fields, seed=st.integers(0, 2**32 - 1), resolution=st.sampled_from((0.03, 0.1, 0.45)))
def test_points_and_the_map_are_on_the_islands_of_the_polygons(field, seed, resolution):
    mesh = NavMesh.build(field, BOUNDS, agent_radius=0.2, resolution=resolution)
    rng = np.random.default_rng(seed)
    corners = np.concatenate([shapely.get_coordinates(island) for island in mesh.islands])
    edges = corners[rng.integers(len(corners), size=60)] + rng.normal(0, resolution / 20, (60, 2))
    points = np.concatenate([rng.uniform(-0.5, 4.5, (60, 2)), edges])
    expected, unclear = island_by_polygons(mesh, points)
    for point, island in zip(points[~unclear], expected[~unclear], strict=True):
        assert mesh.island_of(point) == (island if island >= 0 else None), point
        if island >= 0:
            snapped = mesh.snap(point, island=island)
            inside = shapely.intersects_xy(mesh.islands[island], *point)
            assert np.array_equal(snapped, point) if inside else math.dist(snapped, point) < TOLERANCE
    centres = mesh.cell_centres
    expected, unclear = island_by_polygons(mesh, centres.reshape(-1, 2))
    assert np.array_equal(mesh.topdown_map.ravel()[~unclear], expected[~unclear])


def test_many_samples_are_those_of_many_calls():
    mesh = NavMesh.build([box(1, 1, 2, 3)], BOUNDS)
    one, many = np.random.default_rng(0), np.random.default_rng(0)
    assert np.array_equal([mesh.sample(one) for _ in range(50)], mesh.sample(many, 50))
    assert one.random() == many.random()


@settings(max_examples=60, deadline=None)
@given(field=fields, seed=st.integers(0, 2**32 - 1))
def test_samples_are_navigable_and_keep_their_distance(field, seed):
    mesh = NavMesh.build(field, BOUNDS, agent_radius=0.2)
    p = mesh.sample(np.random.default_rng(seed))
    assert mesh.island_of(p) == 0
    for polygon in field:
        corners = np.array(polygon)
        for a in corners:
            for b in corners:
                assert distance_to_segment(p, a, b) > 0.2 - 1.2e-3
    np.testing.assert_array_equal(p, mesh.sample(np.random.default_rng(seed)))


def test_samples_are_uniform():
    mesh = NavMesh.build([box(0, 1.9, 2.5, 2.1)], BOUNDS, agent_radius=RADIUS)
    rng = np.random.default_rng(1)
    points = np.array([mesh.sample(rng) for _ in range(4000)])
    for lower, upper in (((0, 0), (4, 1.65)), ((0, 2.35), (4, 4)), ((2.75, 1.65), (4, 2.35))):
        share = ((points >= lower) & (points <= upper)).all(axis=1).mean()
        expected = np.prod(np.subtract(upper, lower)) / mesh.area
        assert share == pytest.approx(expected, abs=4 * math.sqrt(expected / 4000))


@pytest.mark.parametrize(
    ("obstacles", "bounds", "options", "fault"),
    [
        ([np.zeros((3, 3))], BOUNDS, {}, "obstacle 0"),
        ([box(0, 0, 1, 1), [(0, math.nan), (1, 1), (1, 0)]], BOUNDS, {}, "obstacle 1"),
        ([], (0, 0, 0, 1), {}, "bounds"),
        ([], (0, 0, 1), {}, "bounds"),
        ([], BOUNDS, {"agent_radius": -1}, "agent_radius"),
        ([], BOUNDS, {"resolution": 0}, "resolution"),
    ],
)
def test_unusable_input_is_named(obstacles, bounds, options, fault):
    with pytest.raises(NavMeshError, match=fault):
        NavMesh.build(obstacles, bounds, **options)


def test_no_room_at_all_is_a_typed_answer():
    with pytest.raises(NotNavigableError, match="nothing navigable"):
        NavMesh.build([box(-1, -1, 5, 5)], BOUNDS)


def test_a_position_that_is_not_finite_is_refused():
    mesh = NavMesh.build([], BOUNDS)
    for ask in (mesh.is_navigable, mesh.snap):
        with pytest.raises(NotNavigableError, match="nan"):
            ask((math.nan, 0.0))
