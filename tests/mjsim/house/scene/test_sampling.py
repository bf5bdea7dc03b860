"""Disorganized houses: what tests/paper/test_section_4.py leaves open, and what happens when there is no room."""

import hashlib
import math
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_worlds import edited, episode_of

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.house import compiled_house
from mjsim.house.compiled.rays import first_hit
from mjsim.house.scene import sampling
from mjsim.house.scene.sampling import sample_episode, sample_points
from mjsim.house.scene.settling import settle
from mjsim.values.errors import SamplingError

LEVELS = (6, 12, 18, 24)
SEEDS = (0, 1, 2, 3)


@dataclass(frozen=True)
class Floor:
    """Floor of the small house, with a round pillar and a ledge that is an island."""

    low: tuple[float, float] = (0.25, 0.25)
    high: tuple[float, float] = (5.75, 3.75)
    pillar: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ledge: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def sample(self, rng):
        while True:
            point = rng.uniform(self.low, self.high)
            if self._walkable(point):
                return point

    def is_navigable(self, point):
        p = np.asarray(point)
        inside = bool((p >= self.low).all() and (p <= self.high).all())
        off_the_partition = abs(p[0] - 3.0) >= 0.3
        return inside and off_the_partition and math.dist(p, self.pillar[:2]) >= self.pillar[2]

    def snap(self, point, max_distance):  # noqa: ARG002
        p = np.asarray(point, dtype=float)
        if self._walkable(p):
            return p
        return np.clip(p, self.low, self.high) + 1.0

    def _walkable(self, point):
        return self.is_navigable(point) and math.dist(point, self.ledge[:2]) >= self.ledge[2]


@pytest.fixture(scope="module")
def episodes(catalogue, navmesh):
    """Episodes of the apartment by (seed, level)."""
    return {
        (seed, level): sample_episode(catalogue, navmesh, objects=level, seed=seed)
        for seed in SEEDS
        for level in LEVELS
    }


def test_the_start_is_near_the_centroid_and_away_from_objects(episodes, navmesh):
    exact = 0
    for episode in episodes.values():
        rests = [o.position[:2] for o in episode.objects]
        centroid = [math.fsum(xy) / len(rests) for xy in zip(*rests, strict=True)]
        start = (episode.start.x, episode.start.y)
        assert navmesh.island_of(start) == 0
        assert -math.pi <= episode.start.heading <= math.pi
        assert min(math.dist(start, r) for r in rests) >= 0.5
        if navmesh.island_of(centroid) == 0 and min(math.dist(centroid, r) for r in rests) >= 0.5:
            exact += 1
            assert math.dist(start, centroid) < 1e-9
        else:
            assert 0 < math.dist(start, centroid) <= 2.0
    assert exact > 0


def test_objects_rest_near_their_points(episodes):
    for episode in episodes.values():
        for o in episode.objects:
            assert math.dist(o.position[:2], o.point) <= 0.3
            assert -0.01 < o.position[2] < 0.35
            assert math.isclose(math.hypot(*o.quaternion), 1.0, abs_tol=1e-12)


def test_no_model_repeats_before_its_category_is_used_up(episodes, catalogue):
    for episode in episodes.values():
        for (category, _), count in Counter((o.category, o.model) for o in episode.objects).items():
            share = sum(o.category == category for o in episode.objects)
            assert count <= math.ceil(share / len(catalogue.categories[category].objects))


def test_seeds_and_blocks_differ(episodes):
    assert len({round(o.quaternion[3], 3) for o in episodes[0, 24].objects}) > 12
    first = [episodes[seed, 6] for seed in SEEDS]
    assert len({e.objects[0].point for e in first}) == len({e.start.heading for e in first}) == len(SEEDS)
    assert len({tuple(o.category for o in e.objects) for e in first}) > 1
    blocks = {tuple(o.category for o in episodes[0, 24].objects[i : i + 6]) for i in (0, 6, 12, 18)}
    assert len(blocks) > 1


@pytest.mark.slow
def test_same_seed_same_episode_in_another_process(episodes, tmp_path):
    code = (
        "import hashlib; from experiments.house import House\n"
        "episode = House.load().sample_episode(objects=18, seed=1)\n"
        "print(hashlib.sha256(episode.to_json().encode()).hexdigest())"
    )
    out = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True
    ).stdout
    assert out.strip() == hashlib.sha256(episodes[1, 18].to_json().encode()).hexdigest()


@pytest.mark.parametrize("objects", [1, 5, 7, 40])
def test_remainders_come_from_the_next_permutation(catalogue, navmesh, objects):
    episode = sample_episode(catalogue, navmesh, objects=objects, seed=7)
    counts = Counter(o.category for o in episode.objects)
    assert len(episode.objects) == objects
    assert max(counts.values()) - min(counts.get(c, 0) for c in catalogue.categories) <= 1
    assert set(episode.receptacles) == set(catalogue.receptacles)


def test_smaller_pools_are_prefixes(small_catalogue):
    few = sample_episode(small_catalogue, Floor(), objects=2, seed=3, points=2)
    more = sample_episode(small_catalogue, Floor(), objects=4, seed=3, points=6)
    assert [(o.point, o.category) for o in few.objects] == [(o.point, o.category) for o in more.objects[:2]]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"objects": 0}, "objects is 0.*1 to 40"),
        ({"objects": 41}, "objects is 41.*1 to 40"),
        ({"objects": 9, "points": 8}, "objects is 9.*1 to 8"),
        ({"points": 0}, "points is 0"),
        ({"points": 10**300}, "points is 1000.* has room for 1000 at most"),
        ({"seed": -1}, "seed is -1"),
    ],
)
def test_bad_arguments_are_named(small_catalogue, arguments, message):
    with pytest.raises(SamplingError, match=message):
        sample_episode(small_catalogue, Floor(), **{"objects": 6, "seed": 0, **arguments})


@pytest.mark.slow
def test_crowded_floor_says_how_much_was_tried(small_catalogue):
    with pytest.raises(SamplingError, match=r"of 40 points .* rejections"):
        sample_episode(small_catalogue, Floor(), objects=6, seed=0)
    with pytest.raises(SamplingError, match=r"of 400 points .* after [0-3]\d{3} rejections"):  # one packing
        sample_episode(small_catalogue, Floor(), objects=6, seed=0, points=400)


TABLE = '<body name="table{0}" pos="{1} {2} 0.35"><geom type="box" size="0.3 0.3 0.35"/></body>'
PLACE = '<site name="place:{0}" pos="{1} {2} 0.7"/>'
TABLES = ((1.0, 0.6), (1.0, 3.4), (4.5, 0.6))


@pytest.fixture
def furnished(fresh_house):
    parts = [text.format(i, *at) for i, at in enumerate(TABLES) for text in (TABLE, PLACE)]
    return edited(fresh_house, "house.xml", "</worldbody>", "".join(parts) + "</worldbody>")


def test_objects_lie_on_the_floor_and_at_the_places_on_furniture(furnished):
    assert compiled_house(furnished).places.tolist() == [[*at, 0.7] for at in TABLES]
    for seed in range(4):
        episode = sample_episode(furnished, Floor(), objects=6, seed=seed, points=6)
        high = [o for o in episode.objects if o.position[2] > 0.6]
        assert {o.point for o in high} == set(TABLES)
        assert all(abs(o.position[2]) < 0.1 for o in episode.objects if o not in high)
        floor = [o.point for o in episode.objects if o not in high]
        assert min(math.dist(a, b) for a in floor for b in (*TABLES, *floor) if a != b) >= 1.0


def test_at_least_two_of_five_points_are_on_the_floor(furnished):
    for points, most in ((1, 0), (2, 1), (4, 2), (5, 3), (6, 3)):
        found = sampling.house_points(furnished, Floor(), seed=0, points=points).tolist()
        assert len(found) == points and sum(tuple(point) in TABLES for point in found) == most


def test_the_first_objects_of_a_house_are_a_mixture(furnished):
    points = [sampling.house_points(furnished, Floor(), seed=seed, points=6) for seed in range(12)]
    assert 2 <= sum(tuple(pool[0].tolist()) in TABLES for pool in points) <= 10


def test_an_object_that_falls_off_furniture_is_refused(fresh_house):
    beside = PLACE.format(0, 2.0, 2.0)  # there is no table below
    catalogue = edited(fresh_house, "house.xml", "</worldbody>", beside + "</worldbody>")
    with pytest.raises(SamplingError, match="fell off furniture in each of 8 drops"):
        sample_episode(catalogue, Floor(), objects=2, seed=0, points=2)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 6))
def test_sampled_points_obey_the_floor(seed, count):
    floor = Floor(pillar=(2.0, 2.0, 0.5))
    away = np.array([[5.0, 3.0]])
    points = sample_points(floor, away, count=count, rng=np.random.default_rng(seed))
    assert points.shape == (count, 2)
    assert all(floor.is_navigable(p) for p in points)
    everything = [*map(tuple, points), (5.0, 3.0)]
    assert min(math.dist(a, b) for a, b in combinations(everything, 2)) >= 1.0


def test_points_are_uniform_over_the_floor():
    """A single point is not rejected, so its quadrants are equally likely (chi-squared, 3 degrees)."""
    floor = Floor()
    rng = np.random.default_rng(0)
    points = np.array([sample_points(floor, np.empty((0, 2)), count=1, rng=rng)[0] for _ in range(4000)])
    east, north = points[:, 0] > 3.0, points[:, 1] > 2.0
    counts = [np.sum((east == e) & (north == n)) for e in (0, 1) for n in (0, 1)]
    assert sum((c - 1000) ** 2 / 1000 for c in counts) < 16.3  # p = 0.001


def test_start_avoids_pillars_and_dead_ends(small_catalogue):
    """The centroid of one object is its own point, which is too near; the pillar and the ledge are not walkable."""
    for seed in range(12):
        plain = sample_episode(small_catalogue, Floor(), objects=4, seed=seed, points=4)
        at = (plain.start.x, plain.start.y)
        for change in ({"pillar": (*at, 0.2)}, {"ledge": (*at, 0.2)}):
            floor = replace(Floor(), **change)
            moved = sample_episode(small_catalogue, floor, objects=4, seed=seed, points=4)
            if [o.point for o in moved.objects] == [o.point for o in plain.objects]:
                assert math.dist((moved.start.x, moved.start.y), at) >= 0.2
            assert floor._walkable(np.array([moved.start.x, moved.start.y]))


@pytest.mark.parametrize("seed", range(4))
def test_no_start_is_an_error(small_catalogue, seed):
    """All of the floor lies within half a metre of the only object, wherever that is."""
    closet = Floor(low=(1.0, 1.0), high=(1.34, 1.34))
    with pytest.raises(SamplingError, match="no navigable start"):
        sample_episode(small_catalogue, closet, objects=1, seed=seed, points=1)


def test_settling_drops_onto_the_floor(small_catalogue):
    settled = settle(episode_of(small_catalogue, (0, 0, 0), ("cube", 1.0, 1.0), height=0.3), small_catalogue)
    assert settled.faults == {}
    assert settled.objects[0].position == pytest.approx((1.0, 1.0, 0.0), abs=0.005)


def test_settling_reports_escapes(small_catalogue):
    settled = settle(
        episode_of(small_catalogue, (0, 0, 0), ("cube", 20.0, 1.0), height=0.01), small_catalogue
    )
    assert "left the house" in settled.faults["o0"]


def test_object_that_rolls_away_is_an_error(small_house, tmp_path):
    for file in small_house.iterdir():
        text = file.read_text(encoding="utf-8").replace(str(small_house), str(tmp_path))
        if file.name == "house.xml":
            text = text.replace("<default>", '<option density="1.2" wind="10 0 0"/><default>', 1)
        text = text.replace('condim="6" friction="1 0.01 0.003"', "")
        (tmp_path / file.name).write_text(text, encoding="utf-8")
    draughty = Catalogue.load(str(tmp_path / "catalogue.toml"))
    with pytest.raises(SamplingError, match=r"'ball'.*rolled"):
        sample_episode(draughty, Floor(), objects=4, seed=0, points=4)


def test_a_start_that_would_face_a_wall_faces_the_longest_view_and_others_stay(catalogue, navmesh):
    """Headings that see at least 0.6 m are those of the seed, and all starts see that far."""
    compiled, turned = compiled_house(catalogue), 0
    for seed in range(40):
        start = sample_episode(catalogue, navmesh, objects=2, seed=seed).start
        drawn = float(sampling._rng(seed, sampling._Purpose.HEADING).uniform(-math.pi, math.pi))
        rays = {h: (math.cos(h), math.sin(h), 0.0) for h in (start.heading, drawn)}
        free = {
            h: first_hit(compiled.model, compiled.data, (start.x, start.y, 1.2), ray)[0]
            for h, ray in rays.items()
        }
        assert free[start.heading] >= sampling.LEAST_VIEW
        if free[drawn] >= sampling.LEAST_VIEW:
            assert start.heading == drawn
        else:
            turned += 1
            assert free[start.heading] > 1.5, "no wall is near in at least one direction"
    assert 0 < turned < 15
