"""Sessions with random placements that cover all object models, receptacles and fill levels.

In each session, the person stands at a random point near a receptacle. Objects of its category are on the
floor around the person, who picks up one after another and places it into the receptacle until it is full.
Only the person's hands move objects.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.support.parallel_sessions import session_episode, upright_object
from experiments.house import House
from mjsim.house.catalogue.catalogue import Category
from mjsim.house.scene.scene import compose
from mjsim.values.actions import IDLE, EventKind, Pick, Place
from mjsim.values.episode import Episode, PlacedObject
from mjsim.values.errors import PhysicsError
from mjsim.values.options import WorldOptions
from mjsim.world.world import World

SEED = 2026
LEVELS = 6  # number of placements per session, into receptacles with 0 to 5 objects
AROUND = (0.4, 0.92)  # range of distances from the person to the objects on the floor, in metres
STRAY = 0.3  # largest deviation of the person from the receptacle's approach point in x and y, in metres
REACH = 0.8  # largest distance from the person to the receptacle's volume, in metres
SPACING = 0.3  # smallest distance between objects on the floor, in metres
DROP = 0.01  # initial height of the objects above the floor, in metres
MAX_STEPS = 400  # maximum number of control steps per motion
NOT_TRIED = ("pick_failed", "refused")
_OUTCOMES = (
    EventKind.PICKED, EventKind.PICK_FAILED, EventKind.PLACED, EventKind.PLACE_FAILED, EventKind.GRIP_LOST,
)  # fmt: skip


@dataclass(frozen=True)
class Placement:
    """An attempt to pick up an object and place it into a receptacle.

    Attributes:
        session: Number of the session, with which `run_session` can repeat it.
        fill: Number of objects that were in the receptacle before.
        outcome: `placed`, `place_failed`, `pick_failed`, `grip_lost`, `refused`, `dislodged` if it pushed another
            object out, or `error` if the physics failed.
        settle_s: Time from the release until the object is at rest, s.
        weld_m: Largest weld error, m.
        weld_rad: Largest weld error, rad.
        penetration: Deepest penetration in each control step, m.
    """

    session: int
    model: str
    receptacle: str
    fill: int
    outcome: str
    ejections: int
    tunnellings: int
    settle_s: float
    weld_m: float
    weld_rad: float
    penetration: NDArray[np.float64]


def run_session(house: House, number: int) -> list[Placement]:
    """Run the session with this number. The same number always gives a bit-identical result."""
    return run_episode(house, make_episode(house, number))


def run_episode(house: House, episode: Episode, options: WorldOptions | None = None) -> list[Placement]:
    world, number = World(compose(episode, house.catalogue), options), episode.seed
    found: list[Placement] = []
    fill = 0
    for placed in episode.objects:
        placement = _transport(world, number, placed, fill)
        found.append(placement)
        if placement.outcome == "error":
            break
        fill += placement.outcome in ("placed", "dislodged")
    return found


def make_episode(house: House, number: int) -> Episode:
    """Create an episode near a receptacle. Categories take turns, and everything else is random."""
    rng = np.random.default_rng([SEED, number])
    category = list(house.catalogue.categories.values())[number % len(house.catalogue.categories)]
    return arrange(house, number, category, list(category.objects) * 2, rng)


def arrange(
    house: House, number: int, category: Category, models: list[str], rng: np.random.Generator
) -> Episode:
    """Place the person near the receptacle of a category, surrounded by `LEVELS` objects of these models."""
    receptacle = house.receptacles[category.receptacle]
    while True:
        stand = _stand(house, category.receptacle, rng)
        spots = _spots(house, stand, rng)
        if len(spots) == LEVELS:
            break
    drawn = [str(model) for model in rng.permutation(models)[:LEVELS]]
    objects = [
        upright_object(house, i, model, spot, DROP, rng.uniform(-math.pi, math.pi))
        for i, (model, spot) in enumerate(zip(drawn, spots, strict=True))
    ]
    towards = math.atan2(*(receptacle.center[:2] - stand)[::-1])
    return session_episode(house, number, stand, float(towards + rng.uniform(-1.5, 1.5)), objects)


def _stand(house: House, key: str, rng: np.random.Generator) -> NDArray[np.float64]:
    """Sample a floor point (2,) near a receptacle's approach point, with the receptacle within reach."""
    receptacle = house.receptacles[key]
    while True:
        point = receptacle.approach + rng.uniform(-STRAY, STRAY, 2)
        if house.navmesh.is_navigable(point) and receptacle.distance(point) < REACH:
            return np.asarray(point)


def _spots(house: House, stand: NDArray[np.float64], rng: np.random.Generator) -> list[NDArray[np.float64]]:
    """Sample floor points (2,) within reach of the person that are clear of each other and of furniture."""
    spots: list[NDArray[np.float64]] = []
    for _ in range(400):
        angle, radius = rng.uniform(-math.pi, math.pi), rng.uniform(*AROUND)
        spot = stand + radius * np.array([math.cos(angle), math.sin(angle)])
        apart = all(np.linalg.norm(spot - other) > SPACING for other in spots)
        free = house.navmesh.is_navigable(spot)
        if apart and free and len(house.body_geodesics.shortest_path(stand, spot).points) == 2:
            spots.append(spot)
            if len(spots) == LEVELS:
                break
    return spots


def _transport(world: World, session: int, placed: PlacedObject, fill: int) -> Placement:
    receptacle = world.scene.episode.targets[placed.name]
    before = world.health
    rows: list[tuple[float, ...]] = []
    outcome = ""
    try:
        outcome = _motion(world, Pick(placed.name), rows)
        if outcome == EventKind.PICKED.value:
            rows.clear()
            outcome = _motion(world, Place(placed.name), rows)
    except PhysicsError:
        outcome = "error"
    table = np.array(rows).reshape(-1, 7)
    after = world.health
    return Placement(
        session=session,
        model=placed.model,
        receptacle=receptacle,
        fill=fill,
        outcome=outcome,
        ejections=after.ejections - before.ejections,
        tunnellings=after.tunnellings - before.tunnellings,
        settle_s=float(np.nanmax(table[:, 6], initial=0.0)),
        weld_m=float(np.nanmax(table[:, 2:4], initial=0.0)),
        weld_rad=float(np.nanmax(table[:, 4:6], initial=0.0)),
        penetration=table[:, 0].copy(),
    )


def _motion(world: World, action: Pick | Place, rows: list[tuple[float, ...]]) -> str:
    """Run a pick or place, return its outcome, and append measurements of each control step to `rows`."""
    step = world.step(action)
    if step.result is None or not step.result.applied:
        return "refused"
    kinds: list[EventKind] = []
    for _ in range(MAX_STEPS):
        rows.append(world.health_sample.row)
        kinds += [event.kind for event in step.events]
        if not world.busy:
            break
        step = world.step(IDLE)
    outcome = next(k for k in reversed(kinds) if k in _OUTCOMES).value
    if outcome == EventKind.PLACED.value and EventKind.DISLODGED in kinds:
        return EventKind.DISLODGED.value
    return outcome
