"""Section 4, the task: each test is a sentence of docs/paper.md, on 200 houses."""

import dataclasses
import math
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from sessions import opened

from experiments.session.familiarise import story_text
from mjsim.house.scene import sampling
from mjsim.values.observation import ObjectStatus

HOUSES = range(200)
LEVELS = (6, 12, 18, 24)
BINS = {  # category -> its bin, and where the paper has that
    "dishes": ("dish_bin", "on the counter, beside the sink"),
    "toys": ("toy_box", None),
    "books": ("bookshelf", None),
    "laundry": ("laundry_hamper", None),
    "office": ("office_box", "on the desk"),
    "recycling": ("recycling_bin", None),
}


@pytest.fixture(scope="module")
def houses(house):
    """Episodes by house and level. Objects are left at their points; test_sampling.py lets them settle."""
    pools, draw = {}, sampling.house_points

    def points_once(*arguments, seed, points):
        if seed not in pools:
            pools[seed] = draw(*arguments, seed=seed, points=points)
        return pools[seed]

    def leave(episode, *_):
        objects = tuple(dataclasses.replace(o, position=(*o.point, 0.0)) for o in episode.objects)
        return dataclasses.replace(episode, objects=objects)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sampling, "house_points", points_once)
        patch.setattr(sampling, "_drop", leave)
        return {(s, n): house.sample_episode(objects=n, seed=s) for s in HOUSES for n in LEVELS}, pools


def test_a_guest_shortly_before_check_out_puts_what_is_misplaced_into_its_bin():
    text = story_text()
    for word in ("guest", "rental", "check-out", "bin", "as little time as possible"):
        assert word in text


def test_six_categories_have_a_bin_each_at_a_sensible_spot(house):
    catalogue = house.catalogue
    found = {key: category.receptacle for key, category in catalogue.categories.items()}
    assert sorted(found.values()) == sorted(bin_ for bin_, _ in BINS.values())
    assert len(found) == 6
    for bin_, place in BINS.values():
        assert place is None or catalogue.receptacles[bin_].place == place
        assert house.receptacles[bin_].distance(house.approaches[bin_]) < 1.0


def test_bins_stay_fixed_over_difficulties(house):
    places = {
        n: {key: tuple(r.center) for key, r in opened(house, "none", objects=n)[1].scene.receptacles.items()}
        for n in (6, 24)
    }
    assert places[6] == places[24]


@pytest.mark.slow
def test_forty_points_are_navigable_and_a_metre_from_each_other_and_from_every_bin(houses, house):
    bins = np.array([r.center[:2] for r in house.receptacles.values()])
    for points in houses[1].values():
        assert points.shape == (40, 2)
        everything = np.vstack([points, bins])
        gaps = np.linalg.norm(points[:, None] - everything[None], axis=2)
        np.fill_diagonal(gaps, np.inf)
        assert gaps.min() >= 1.0
        assert all(house.navmesh.island_of(point) == 0 for point in points)


@pytest.mark.slow
def test_each_difficulty_uses_the_first_points_and_contains_the_one_below(houses):
    episodes, pools = houses
    for seed in HOUSES:
        for level in LEVELS:
            points = [o.point for o in episodes[seed, level].objects]
            assert np.array_equal(np.array(points), pools[seed][:level])
        for easier, harder in pairwise(LEVELS):
            pairs = zip(episodes[seed, easier].objects, episodes[seed, harder].objects, strict=False)
            assert all((a.name, a.point) == (b.name, b.point) for a, b in pairs)


def test_a_point_keeps_its_category_and_all_categories_are_equal_in_number(houses, house):
    episodes, _ = houses
    for (seed, level), episode in episodes.items():
        categories = [o.category for o in episode.objects]
        assert Counter(categories) == dict.fromkeys(house.catalogue.categories, level // 6)
        assert categories == [o.category for o in episodes[seed, 24].objects][:level]


def test_the_object_model_of_a_point_is_drawn_anew_at_each_level(houses):
    """Equal models at two levels are as rare as drawing one of several models by chance makes them."""
    episodes, _ = houses
    same = [
        a.model == b.model
        for seed in HOUSES
        for easier, harder in pairwise(LEVELS)
        for a, b in zip(episodes[seed, easier].objects, episodes[seed, harder].objects, strict=False)
    ]
    assert 0.02 < np.mean(same) < 0.5


def test_the_start_is_the_centroid_or_a_navigable_point_near_it(houses, house):
    episodes, _ = houses
    exact = 0
    for episode in episodes.values():
        centroid = np.mean([o.position[:2] for o in episode.objects], axis=0)
        start = (episode.start.x, episode.start.y)
        assert house.navmesh.island_of(start) == 0
        assert math.dist(start, centroid) <= 2.0
        exact += math.dist(start, centroid) < 1e-9
    assert exact > 100


def test_the_task_is_over_when_everything_is_in_its_bin(followed):
    assert followed.events[-1]["reason"] == "all delivered"
    assert set(followed.shown[-1][0].object_status) == {ObjectStatus.DELIVERED}
    for name, key in followed.world.scene.episode.targets.items():
        observation = followed.shown[-1][0]
        place = observation.object_positions[observation.object_names.index(name)]
        assert followed.world.scene.receptacles[key].contains(place)
