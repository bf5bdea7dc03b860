"""Compare shortest paths with a closed form and with a brute-force visibility graph."""

import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import floyd_warshall

import planner.geodesics
from mjsim.world.walking.polyline import path_length
from planner.errors import NotNavigableError, UnreachableError
from planner.geodesics import Geodesics
from planner.navmesh import NavMesh

BOUNDS = (0.0, 0.0, 4.0, 4.0)
seeds = st.integers(0, 2**32 - 1)


def box(x0, y0, x1, y1):
    return np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], dtype=float)


def random_field(seed, count=8):
    """Return random boxes, rotated boxes and triangles on a floor of 4 x 4 m."""
    rng = np.random.default_rng(seed)
    field = []
    for _ in range(rng.integers(1, count + 1)):
        centre, size, angle = rng.uniform(0, 4, 2), rng.uniform(0.02, 0.6, 2), rng.uniform(0, math.pi)
        rotation = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        corners = (box(-1, -1, 1, 1) * size)[: rng.integers(3, 5)]
        field.append(centre + (corners @ rotation.T if rng.random() < 0.5 else corners))
    return field


def sampled(mesh, seed, count):
    rng = np.random.default_rng(seed)
    return np.array([mesh.sample(rng) for _ in range(count)])


def brute_force(field, radius, points):
    """Return the distances between points, computed with a visibility graph of the inflated obstacles."""
    inflated = shapely.unary_union(
        [shapely.convex_hull(shapely.MultiPoint(p)).buffer(radius, 8) for p in field]
    )
    solid = inflated.buffer(-1e-4, join_style="mitre")
    shapely.prepare(solid)
    corners = shapely.get_coordinates(shapely.box(*BOUNDS).difference(inflated))
    nodes = np.vstack([points, np.unique(corners, axis=0)])
    i, j = np.triu_indices(len(nodes), 1)
    lines = shapely.linestrings(np.stack([nodes[i], nodes[j]], axis=1))
    free = ~shapely.intersects(solid, lines)
    weights = np.full((len(nodes), len(nodes)), np.inf)
    weights[i[free], j[free]] = np.hypot(*(nodes[i[free]] - nodes[j[free]]).T)
    weights = np.minimum(weights, weights.T)
    np.fill_diagonal(weights, 0)
    return floyd_warshall(weights)[: len(points), : len(points)]


def test_around_a_pillar_the_path_is_two_tangents_and_an_arc():
    mesh = NavMesh.build([[(2.0, 2.0)]], BOUNDS, agent_radius=0.5)
    path = Geodesics(mesh).shortest_path((1.0, 2.0), (3.0, 2.0))
    tangent, angle = math.sqrt(1 - 0.25), math.pi - 2 * math.acos(0.5)
    assert path.geodesic_distance == pytest.approx(2 * tangent + 0.5 * angle, rel=2e-3)
    assert len(path.points) > 3


@settings(max_examples=40, deadline=None)
@given(seed=seeds)
def test_distances_equal_those_over_all_vertices_without_pruning(seed):
    field = random_field(seed, 6)
    mesh = NavMesh.build(field, BOUNDS, agent_radius=0.2)
    points = sampled(mesh, seed, 6)
    expected = brute_force(field, 0.2, points)
    np.testing.assert_allclose(Geodesics(mesh).distances(points), expected, atol=1e-9)


@settings(max_examples=40, deadline=None)
@given(seed=seeds)
def test_distances_are_a_metric_and_paths_have_their_length(seed):
    mesh = NavMesh.build(random_field(seed), BOUNDS, agent_radius=0.2)
    geodesics = Geodesics(mesh)
    points = sampled(mesh, seed, 7)
    points[-1] = points[0]
    d = geodesics.distances(points)
    np.testing.assert_array_equal(d, d.T)
    assert not np.diagonal(d).any()
    assert d[0, -1] == 0
    straight = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    assert (d >= straight - 1e-9).all()
    assert (d[:, None, :] <= d[:, :, None] + d[None, :, :] + 1e-9).all()
    np.testing.assert_allclose(geodesics.distances_between(points[:1], points[1:])[0], d[0, 1:], atol=1e-9)
    for i, j in itertools.combinations(range(6), 2):
        path = geodesics.shortest_path(points[i], points[j])
        assert path.geodesic_distance == pytest.approx(d[i, j], abs=1e-9)
        assert path_length(path.points) == pytest.approx(d[i, j], abs=1e-9)
        np.testing.assert_array_equal(path.points[[0, -1]], points[[i, j]])
        assert not shapely.LineString(path.points).intersects(mesh.solid)
        back = geodesics.shortest_path(points[j], points[i])
        assert back.geodesic_distance == pytest.approx(d[i, j], abs=1e-9)


def test_what_is_remembered_changes_no_distance(monkeypatch):
    mesh = NavMesh.build(random_field(3), BOUNDS, agent_radius=0.2)
    points = mesh.sample(np.random.default_rng(3), 12)
    expected = Geodesics(mesh).distances(points)
    monkeypatch.setattr(planner.geodesics, "MAX_CACHED", 5)
    geodesics = Geodesics(mesh)
    for _ in range(2):
        np.testing.assert_array_equal(geodesics.distances(points), expected)


def test_a_blocked_way_is_a_typed_answer_that_names_both_ends():
    geodesics = Geodesics(NavMesh.build([box(1.9, 0, 2.1, 4)], BOUNDS))
    a, b, c = (0.5, 0.5), (3.5, 0.5), (0.5, 3.0)
    for ask in (
        lambda: geodesics.shortest_path(a, b),
        lambda: geodesics.distances([a, c, b]),
        lambda: geodesics.distances_between([a], [c, b]),
    ):
        with pytest.raises(UnreachableError, match=r"\(0\.500, 0\.500\).*\(3\.500, 0\.500\)"):
            ask()


def test_points_inside_obstacles_are_snapped_within_reach():
    geodesics = Geodesics(NavMesh.build([box(1, 1, 2, 3)], BOUNDS), max_snap=0.5)
    path = geodesics.shortest_path((1.9, 2.0), (3.0, 2.0))
    np.testing.assert_allclose(path.points[0], (2.25, 2.0), atol=1e-5)
    assert path.geodesic_distance == pytest.approx(0.75, abs=1e-5)
    with pytest.raises(NotNavigableError, match=r"1\.500, 2\.000"):
        geodesics.shortest_path((1.5, 2.0), (3.0, 2.0))


def test_no_points_no_distances():
    geodesics = Geodesics(NavMesh.build([], BOUNDS))
    assert geodesics.distances(np.empty((0, 2))).shape == (0, 0)
    assert geodesics.distances_between([(1, 1)], np.empty((0, 2))).shape == (1, 0)


@settings(max_examples=40, deadline=None)
@given(seeds)
def test_a_point_that_is_navigable_by_tolerance_only_is_as_far_as_the_one_beside_it(seed):
    mesh = NavMesh.build(random_field(seed), BOUNDS, agent_radius=0.1)
    island, rng = mesh.islands[0], np.random.default_rng(seed)
    edge = np.array([island.boundary.interpolate(s, normalized=True).coords[0] for s in rng.random(20)])
    beyond = edge + 3e-5 * np.column_stack([np.cos(angle := rng.uniform(0, math.tau, 20)), np.sin(angle)])
    kept = [
        k
        for k in range(20)
        if mesh.island_of(beyond[k]) == 0 and not shapely.intersects_xy(island, *beyond[k])
    ]
    assume(kept)
    geodesics, targets = Geodesics(mesh), sampled(mesh, seed, 5)
    found = geodesics.distances_between(beyond[kept], targets)
    np.testing.assert_allclose(found, geodesics.distances_between(edge[kept], targets), atol=1e-3)
    assert all(geodesics.shortest_path(beyond[k], targets[0]).geodesic_distance < 20 for k in kept)
