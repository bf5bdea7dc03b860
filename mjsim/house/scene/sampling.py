"""Sampling of disorganized houses, as in PAPER section 4.

Every random choice has its own stream, keyed by the seed and its purpose, so that the points of a seed are
the same at every level and a change in one choice leaves the others as they are.
"""

import enum
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.house import NavigablePoints, compiled_house, navigable_floor
from mjsim.house.scene.disorder import Disorder
from mjsim.house.scene.settling import settle
from mjsim.house.validation.validate import require_usable
from mjsim.values.episode import POINTS, Episode, PlacedObject, StartPose
from mjsim.values.errors import SamplingError, brief

MIN_DISTANCE = 1.0  # m, between points, and from points to receptacles
START_CLEARANCE = 0.5  # m, from the start to every object
DROP = (0.01, 0.02)  # m above the floor
PACKINGS, DRAWS = 20, 4000  # a jammed packing is given up as a whole, to keep the points uniform
DROPS = 8
MAX_POINTS = 1000  # a metre apart
RADIUS_STEP, RADII, DRAWS_PER_RADIUS = 0.25, 80, 32


class _Purpose(enum.IntEnum):
    """Keys of the random streams; their numbers are part of what a seed means."""

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
    """Sample a disorganized house.

    Points and their categories follow from the seed alone, so that a level holds the easier ones. The object
    model of a point is drawn again at each level; none repeats before all of its category were used.

    Args:
        catalogue: What the house offers.
        navigable: The navigable floor of the same house; None for that of the installed planner.
        objects: How many objects: the level, 1 to `points`. Categories are equally frequent when it is a
            multiple of their number.
        seed: Not negative.
        points: Size of the pool of points that the levels draw from; that of the house where it has fewer.
        disorder: How far objects lie from where they belong: of the pool, each takes a point about as far from its
            receptacle. None for the first points, which are anywhere.

    Returns:
        The episode, its objects at rest on the floor.

    Raises:
        SamplingError: An argument is out of range, or the house has no room for the points, the objects or
            the start.
        AssetError: A model of the catalogue is unusable.
        PhysicsError: MuJoCo warned while the objects settled.

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
    placed = tuple(
        PlacedObject(f"object_{i:02d}", category, model, (float(x), float(y)), (0, 0, 0), (1, 0, 0, 0))
        for i, (category, model, (x, y)) in enumerate(zip(categories, models, pool[:objects], strict=True))
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
    return replace(episode, start=_start(episode, navigable, _rng(seed, _Purpose.START, objects)))


def house_points(
    catalogue: Catalogue, navigable: NavigablePoints, *, seed: int, points: int = POINTS
) -> NDArray[np.float64]:
    """The points of a seed that its levels share, m, shape (points, 2); `SamplingError` where they do not fit."""
    points = min(points, catalogue.points or points)
    centers = np.array([r.center[:2] for r in compiled_house(catalogue).receptacles.values()])
    return sample_points(navigable, centers, count=points, rng=_rng(seed, _Purpose.POINTS))


def sample_points(
    navigable: NavigablePoints,
    keep_away: NDArray[np.float64],
    *,
    count: int,
    rng: np.random.Generator,
    min_distance: float = MIN_DISTANCE,
) -> NDArray[np.float64]:
    """Draw navigable points (count, 2), m, by rejection, apart from each other and from `keep_away` (k, 2)."""
    best = 0
    for _ in range(PACKINGS):
        points = _pack(navigable, keep_away, count, rng, min_distance)
        if len(points) == count:
            return points
        best = max(best, len(points))
    raise SamplingError(
        f"only {best} of {count} points fit at least {min_distance} m from each other and from "
        f"{len(keep_away)} receptacles, after {PACKINGS * DRAWS - best} rejections; "
        "ask for fewer points (--points) or use a larger house"
    )


def points_that_fit(navigable: NavigablePoints, keep_away: NDArray[np.float64], count: int = POINTS) -> int:
    """How many points, `count` at most, one packing holds; arguments as in `sample_points`."""
    return len(_pack(navigable, keep_away, count, np.random.default_rng(0), MIN_DISTANCE))


def _pack(
    navigable: NavigablePoints,
    keep_away: NDArray[np.float64],
    count: int,
    rng: np.random.Generator,
    min_distance: float,
) -> NDArray[np.float64]:
    """As many points as come in `DRAWS` draws, `count` at most, m, shape (k, 2)."""
    taken = np.empty((len(keep_away) + count, 2))
    taken[: len(keep_away)] = keep_away
    filled = len(keep_away)
    for _ in range(DRAWS):
        if filled == len(taken):
            break
        point = navigable.sample(rng)
        if (np.hypot(*(taken[:filled] - point).T) >= min_distance).all():
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
    """Category per point: every block of as many points as categories is a permutation of them."""
    keys = list(catalogue.categories)
    blocks = -(-count // len(keys))
    order = np.concatenate([rng.permutation(len(keys)) for _ in range(blocks)])
    return [keys[i] for i in order[:count]]


def _point_models(catalogue: Catalogue, categories: Sequence[str], rng: np.random.Generator) -> list[str]:
    """Object model per point; a category's models are drawn without replacement, and again when all are used."""
    decks: dict[str, list[str]] = {key: [] for key in catalogue.categories}
    models = []
    for category in categories:
        if not decks[category]:
            choices = catalogue.categories[category].objects
            decks[category] = [choices[i] for i in rng.permutation(len(choices))]
        models.append(decks[category].pop())
    return models


def _drop(episode: Episode, catalogue: Catalogue, rng: np.random.Generator) -> Episode:
    """Drop the objects upright with a random yaw; those that roll away are dropped again."""
    dropped = tuple(_above_floor(o, rng) for o in episode.objects)
    for _ in range(DROPS):
        settled = settle(replace(episode, objects=dropped), catalogue)
        if not settled.faults:
            return replace(episode, objects=settled.objects)
        dropped = tuple(_above_floor(o, rng) if o.name in settled.faults else o for o in dropped)
    name, fault = next(iter(settled.faults.items()))
    model = next(o.model for o in episode.objects if o.name == name)
    raise SamplingError(
        f"{name}, a {model!r}, {fault} in each of {DROPS} drops at seed {episode.seed}; flatten the model, "
        "give it rolling friction (condim 6), or take another seed"
    )


def _above_floor(placed: PlacedObject, rng: np.random.Generator) -> PlacedObject:
    yaw, height = rng.uniform(-math.pi, math.pi), rng.uniform(*DROP)
    quaternion = (math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2))
    return replace(placed, position=(*placed.point, float(height)), quaternion=quaternion)


def _start(episode: Episode, navigable: NavigablePoints, rng: np.random.Generator) -> StartPose:
    """The first candidate where a person can start."""
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
    """The objects' centroid (2,), m, then random points in larger and larger circles around it."""
    yield centroid
    for radius in RADIUS_STEP * np.arange(1, RADII + 1):
        for _ in range(DRAWS_PER_RADIUS):
            # The square root spreads the points evenly over the disc.
            reach, angle = radius * math.sqrt(rng.random()), rng.uniform(-math.pi, math.pi)
            yield centroid + reach * np.array([math.cos(angle), math.sin(angle)])


def _can_start(point: NDArray[np.float64], objects: NDArray[np.float64], navigable: NavigablePoints) -> bool:
    clear = bool((np.hypot(*(objects - point).T) >= START_CLEARANCE).all())
    # Snapping tells the floor that all objects are on from islands of it, such as the inside of a table.
    return (
        clear
        and navigable.is_navigable(point)
        and bool(np.allclose(navigable.snap(point, math.inf), point, rtol=0.0, atol=1e-9))
    )
