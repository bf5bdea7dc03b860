"""Sample episodes in which objects of a house are misplaced (PAPER section 4).

Each random choice has its own generator, which is derived from the seed and the purpose of the choice. A seed
therefore has the same points at every level, and changing one choice does not affect the others.
"""

import enum
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.house import CompiledHouse, NavigablePoints, compiled_house, navigable_floor
from mjsim.house.compiled.rays import first_hit
from mjsim.house.scene.disorder import Disorder
from mjsim.house.scene.settling import settle
from mjsim.house.validation.validate import require_usable
from mjsim.values.episode import FLOOR_SHARE, POINTS, Episode, PlacedObject, StartPose
from mjsim.values.errors import SamplingError, brief

MIN_DISTANCE = 1.0  # minimum distance between two points, or a point and a receptacle, in metres
START_CLEARANCE = 0.5  # minimum distance from the person's start position to any object, in metres
DROP = (0.01, 0.02)  # range of heights from which objects are dropped, in metres
MAX_FALL = 0.1  # maximum distance from a surface down to an object that was dropped onto it, in metres
PACKINGS, DRAWS = 20, 4000  # Incomplete sets of points are discarded to keep the distribution uniform.
# Maximum ratio of the sizes of two sets of points that cannot be extended: each point blocks at most seven others
MAX_RATIO = 7
DROPS = 8
MAX_POINTS = 1000
LEAST_VIEW = 0.6  # minimum distance between the start position and a wall ahead, in metres
CHEST = 1.2  # height at which the view ahead must be free, in metres
# Number of headings. If the person would start facing a wall, the one with the longest view is used instead.
HEADINGS = 16
RADIUS_STEP, RADII, DRAWS_PER_RADIUS = 0.25, 80, 32


class _Purpose(enum.IntEnum):
    """Keys of the random generators. Changing a key changes the episodes of all seeds."""

    POINTS = 0
    CATEGORIES = 1
    MODELS = 2
    DROP = 3
    START = 4
    HEADING = 5


def sample_episode(
    catalogue: Catalogue,
    navigable: NavigablePoints | None = None,
    *,
    objects: int,
    seed: int,
    points: int = POINTS,
    disorder: Disorder | None = None,
) -> Episode:
    """Sample an episode, with misplaced objects and a start position, for a house.

    Points and their categories depend only on the seed, so each level includes the points of easier levels.
    Object models are drawn again for each level, and repeat only after all models of a category are used.

    Args:
        catalogue: Catalogue of the house.
        navigable: Walkable floor of the house. By default, the installed planner computes it.
        objects: Number of objects, from 1 to `points`, which is also called the level. All categories are
            equally frequent if the level is a multiple of the number of categories.
        seed: Seed of the random choices, 0 or larger.
        points: Number of points shared by all levels, limited to the number that the house is designed for.
        disorder: Statistics of observed disorder. If given, each object is placed at a point whose distance
            from its receptacle is close to an observed distance. By default, the first points are used.

    Returns:
        The episode, with all objects at rest on the floor or on furniture.

    Raises:
        SamplingError: An argument is out of range, or the house has no room for the points, objects or start.
        AssetError: A model of the catalogue is invalid.
        PhysicsError: MuJoCo reported a warning while the objects settled.

    Example:
        >>> episode = sample_episode(Catalogue.load("apartment"), objects=2, seed=3)
        >>> episode.targets
        {'object_00': 'toy_box', 'object_01': 'bookshelf'}
    """
    points = min(points, catalogue.points or points)
    _check_arguments(objects, seed, points)
    require_usable(compiled_house(catalogue))
    if navigable is None:
        navigable = navigable_floor(catalogue)
    pool = house_points(catalogue, navigable, seed=seed, points=points)
    categories = _point_categories(catalogue, points, _rng(seed, _Purpose.CATEGORIES))[:objects]
    models = _point_models(catalogue, categories, _rng(seed, _Purpose.MODELS, objects))
    if disorder is not None:
        receptacles = compiled_house(catalogue).receptacles
        homes = [receptacles[catalogue.categories[key].receptacle].center[:2] for key in categories]
        pool = pool[disorder.assign(pool, np.array(homes), seed)]
    surfaces = {(x, y): z for x, y, z in compiled_house(catalogue).places.tolist()}
    placed = tuple(
        PlacedObject(
            f"object_{i:02d}", category, model, (x, y), (x, y, surfaces.get((x, y), 0.0)), (1, 0, 0, 0)
        )
        for i, (category, model, (x, y)) in enumerate(
            zip(categories, models, pool[:objects].tolist(), strict=True)
        )
    )
    episode = Episode(
        house=catalogue.name,
        seed=int(seed),
        start=StartPose(0.0, 0.0, float(_rng(seed, _Purpose.HEADING).uniform(-math.pi, math.pi))),
        objects=placed,
        receptacles=tuple(catalogue.receptacles),
        targets={o.name: catalogue.categories[o.category].receptacle for o in placed},
    )
    episode = _drop(episode, catalogue, _rng(seed, _Purpose.DROP, objects))
    start = _start(episode, navigable, _rng(seed, _Purpose.START, objects))
    return replace(episode, start=replace(start, heading=_heading(start, catalogue)))


def house_points(
    catalogue: Catalogue, navigable: NavigablePoints, *, seed: int, points: int = POINTS
) -> NDArray[np.float64]:
    """Return the points for all levels of a seed, in metres, shape (points, 2). May raise a SamplingError."""
    house, rng = compiled_house(catalogue), _rng(seed, _Purpose.POINTS)
    points = min(points, catalogue.points or points)
    on_top = _places_on_furniture(house, points, rng)
    floor = sample_points(navigable, _keep_away(house, on_top), count=points - len(on_top), rng=rng)
    return rng.permutation(np.concatenate([floor, on_top[:, :2]])) if len(on_top) else floor


def _places_on_furniture(house: CompiledHouse, points: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Choose random places on furniture for some of `points` objects, in metres, shape (k, 3)."""
    if not len(house.places):
        return house.places
    return house.places[rng.permutation(len(house.places))[: math.floor((1 - FLOOR_SHARE) * points)]]


def _keep_away(house: CompiledHouse, on_top: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the points (k, 2) from which points on the floor keep a distance, in metres."""
    return np.array([*(r.center[:2] for r in house.receptacles.values()), *on_top[:, :2]])


def sample_points(
    navigable: NavigablePoints,
    keep_away: NDArray[np.float64],
    *,
    count: int,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Return random walkable points (count, 2) far from each other and from `keep_away` (k, 2), in metres."""
    found: list[int] = []
    for _ in range(PACKINGS):
        points = _pack(navigable, keep_away, count, rng)
        if len(points) == count:
            return points
        found.append(len(points))
        if count > MAX_RATIO * len(points):
            break
    raise SamplingError(
        f"only {max(found)} of {count} points fit at least {MIN_DISTANCE} m from each other and from "
        f"{len(keep_away)} receptacles, after {len(found) * DRAWS - max(found)} rejections; "
        "ask for fewer points (--points) or use a larger house"
    )


def points_that_fit(house: CompiledHouse, navigable: NavigablePoints, count: int = POINTS) -> int:
    """Try once to draw `count` points for objects in a house, and return how many were found."""
    rng = np.random.default_rng(0)
    on_top = _places_on_furniture(house, count, rng)
    return len(on_top) + len(_pack(navigable, _keep_away(house, on_top), count - len(on_top), rng))


def _pack(
    navigable: NavigablePoints,
    keep_away: NDArray[np.float64],
    count: int,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    taken = np.empty((len(keep_away) + count, 2))
    taken[: len(keep_away)] = keep_away
    filled = len(keep_away)
    for _ in range(DRAWS):
        if filled == len(taken):
            break
        point = navigable.sample(rng)
        if (np.hypot(*(taken[:filled] - point).T) >= MIN_DISTANCE).all():
            taken[filled] = point
            filled += 1
    return taken[len(keep_away) : filled]


def _check_arguments(objects: int, seed: int, points: int) -> None:
    if points < 1:
        raise SamplingError(f"points is {points}; the pool needs at least 1")
    if points > MAX_POINTS:
        raise SamplingError(f"points is {brief(str(points), 40)}; a house has room for {MAX_POINTS} at most")
    if not 1 <= objects <= points:
        raise SamplingError(f"objects is {objects}; it must be 1 to {points}, the number of points")
    if seed < 0:
        raise SamplingError(f"seed is {seed}; it must not be negative")


def _rng(seed: int, purpose: _Purpose, *level: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence([seed, int(purpose), *level]))


def _point_categories(catalogue: Catalogue, count: int, rng: np.random.Generator) -> list[str]:
    keys = list(catalogue.categories)
    blocks = -(-count // len(keys))
    order = np.concatenate([rng.permutation(len(keys)) for _ in range(blocks)])
    return [keys[i] for i in order[:count]]


def _point_models(catalogue: Catalogue, categories: Sequence[str], rng: np.random.Generator) -> list[str]:
    decks: dict[str, list[str]] = {key: [] for key in catalogue.categories}
    models = []
    for category in categories:
        if not decks[category]:
            choices = catalogue.categories[category].objects
            decks[category] = [choices[i] for i in rng.permutation(len(choices))]
        models.append(decks[category].pop())
    return models


def _drop(episode: Episode, catalogue: Catalogue, rng: np.random.Generator) -> Episode:
    dropped = tuple(_above_surface(o, rng) for o in episode.objects)
    for _ in range(DROPS):
        settled = settle(replace(episode, objects=dropped), catalogue)
        faults = settled.faults | _fallen(episode.objects, settled.objects)
        if not faults:
            return replace(episode, objects=settled.objects)
        dropped = tuple(
            _above_surface(o, rng) if o.name in faults else last
            for o, last in zip(episode.objects, dropped, strict=True)
        )
    name, fault = next(iter(faults.items()))
    model = next(o.model for o in episode.objects if o.name == name)
    raise SamplingError(
        f"{name}, a {model!r}, {fault} in each of {DROPS} drops at seed {episode.seed}; flatten the model, "
        "give it rolling friction (condim 6), or take another seed"
    )


def _fallen(placed: Sequence[PlacedObject], settled: Sequence[PlacedObject]) -> dict[str, str]:
    """Return a fault for each object that is below the surface onto which it was dropped."""
    pairs = zip(placed, settled, strict=True)
    return {a.name: "fell off furniture" for a, b in pairs if b.position[2] < a.position[2] - MAX_FALL}


def _above_surface(placed: PlacedObject, rng: np.random.Generator) -> PlacedObject:
    yaw, height = rng.uniform(-math.pi, math.pi), rng.uniform(*DROP)
    quaternion = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
    return replace(
        placed, position=(*placed.point, placed.position[2] + float(height)), quaternion=quaternion
    )


def _start(episode: Episode, navigable: NavigablePoints, rng: np.random.Generator) -> StartPose:
    objects = np.array([o.position[:2] for o in episode.objects])
    centroid = objects.mean(axis=0)
    for point in _start_candidates(centroid, rng):
        if _can_start(point, objects, navigable):
            return StartPose(float(point[0]), float(point[1]), episode.start.heading)
    raise SamplingError(
        f"no navigable start {START_CLEARANCE} m from every object within {RADIUS_STEP * RADII} m of "
        f"their centroid {centroid.round(2).tolist()} after {RADII * DRAWS_PER_RADIUS} rejections; "
        "take another seed"
    )


def _start_candidates(
    centroid: NDArray[np.float64], rng: np.random.Generator
) -> Iterator[NDArray[np.float64]]:
    yield centroid
    for radius in RADIUS_STEP * np.arange(1, RADII + 1):
        for _ in range(DRAWS_PER_RADIUS):
            # The square root makes the distribution uniform over the disc.
            reach, angle = radius * math.sqrt(rng.random()), rng.uniform(-math.pi, math.pi)
            yield centroid + reach * np.array([math.cos(angle), math.sin(angle)])


def _heading(start: StartPose, catalogue: Catalogue) -> float:
    """Return the heading of a start, or the one with the longest view if the start faces a wall."""
    house, eye = compiled_house(catalogue), (start.x, start.y, CHEST)

    def view(heading: float) -> float:
        return first_hit(house.model, house.data, eye, (math.cos(heading), math.sin(heading), 0.0))[0]

    if view(start.heading) >= LEAST_VIEW:
        return start.heading
    turns = (math.remainder(start.heading + k * math.tau / HEADINGS, math.tau) for k in range(HEADINGS))
    return max(turns, key=view)


def _can_start(point: NDArray[np.float64], objects: NDArray[np.float64], navigable: NavigablePoints) -> bool:
    clear = bool((np.hypot(*(objects - point).T) >= START_CLEARANCE).all())
    # A point in an isolated area, such as inside a table, is rejected because snapping would move it.
    return (
        clear
        and navigable.is_navigable(point)
        and bool(np.allclose(navigable.snap(point, math.inf), point, rtol=0.0, atol=1e-9))
    )
