"""Many worlds on many threads: every state is the one that each world reaches alone."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from mjsim.actions import Action, EventKind, Move, Pick, Place
from mjsim.episode import Episode, PlacedObject, StartPose
from mjsim.errors import ActionError, PhysicsError
from mjsim.model.catalogue import Catalogue
from mjsim.model.scene import Scene, compose
from mjsim.options import FIDELITIES, WorldOptions
from mjsim.world import World
from mjsim.worlds import Worlds

THREADS = (1, 2, 3)
THINGS = (("cube", "solids"), ("ball", "rounds"), ("wedge", "solids"))
STEPS = 90


def _scene(catalogue: Catalogue, count: int) -> Scene:
    """The first of some things around somebody in the middle of the west room."""
    placed, targets = [], {}
    for number, (model, category) in enumerate(THINGS[:count]):
        spot = (1.5 + 0.5 * np.cos(number), 2.0 + 0.5 * np.sin(number))
        at = (float(spot[0]), float(spot[1]))
        placed.append(PlacedObject(f"o{number}", category, model, at, (*at, 0.01), (1.0, 0.0, 0.0, 0.0)))
        targets[f"o{number}"] = catalogue.categories[category].receptacle
    keys = tuple(catalogue.receptacles)
    return compose(
        Episode(catalogue.name, 0, StartPose(1.5, 2.0, 0.0), tuple(placed), keys, targets), catalogue
    )


@pytest.fixture(scope="module")
def scenes(small_catalogue: Catalogue) -> list[Scene]:
    return [_scene(small_catalogue, count) for count in (1, 2, 3)]


@pytest.fixture(scope="module")
def make(scenes: list[Scene]) -> Callable[[], list[World]]:
    """Worlds of different sizes, two of the same scene, in every fidelity."""
    return lambda: [
        World(scene, WorldOptions(fidelity=fidelity))
        for scene, fidelity in zip([*scenes, scenes[0]], [*FIDELITIES, "full"], strict=True)
    ]


def _script(seed: int) -> Iterator[Action]:
    """Walks about, picks what is near, and tries to put it away."""
    rng = np.random.default_rng(seed)
    yield Pick()
    while True:
        for _ in range(int(rng.integers(5, 30))):
            yield Move(*rng.uniform((-0.5, -0.5, -2.0, -0.5), (1.4, 0.5, 2.0, 0.5)).tolist())
        yield Place() if rng.random() < 0.5 else Pick()


def _alone(worlds: list[World]) -> list[list[int]]:
    """State hashes (step by step) of worlds that are stepped one after another."""
    hashes = []
    for seed, world in enumerate(worlds):
        script = _script(seed)
        world.reset()
        hashes.append([(world.step(next(script)), world.state_hash())[1] for _ in range(STEPS)])
    return hashes


@pytest.mark.parametrize("threads", THREADS)
def test_every_state_is_that_of_a_world_alone(make: Callable[[], list[World]], threads: int) -> None:
    expected = _alone(make())
    assert len({tuple(hashes) for hashes in expected}) == 4
    with Worlds(make(), threads=threads) as worlds:
        scripts = [_script(seed) for seed in range(4)]
        start = worlds.reset()
        assert [len(o.object_names) for o in start] == [1, 2, 3, 1]
        picked = 0
        for step in range(STEPS):
            results = worlds.step([next(script) for script in scripts])
            assert [world.state_hash() for world in worlds] == [hashes[step] for hashes in expected]
            assert [r.observation.time for r in results] == [w.observation().time for w in worlds]
            picked += sum(e.kind is EventKind.PICKED for r in results for e in r.events)
    assert picked >= 4


@pytest.mark.parametrize("threads", THREADS)
def test_stretches_are_those_of_a_world_alone(make: Callable[[], list[World]], threads: int) -> None:
    rng = np.random.default_rng(1)
    moves = [rng.uniform(-1, 1, (rows, 4)) for rows in (20, 0, 7, 13)]
    expected = []
    for world, rows in zip(make(), moves, strict=True):
        walked = world.walk(rows)
        world.step(Pick())
        expected.append((walked, world.finish()))
    with Worlds(make(), threads=threads) as worlds:
        walked = worlds.walk(moves)
        worlds.step([Pick()] * 4)
        finished = worlds.finish()
    for (one, two), *others in zip(expected, walked, finished, strict=True):
        for mine, other in zip((one, two), others, strict=True):
            np.testing.assert_array_equal(mine.state_hashes, other.state_hashes)
            assert mine.events == other.events


@pytest.mark.parametrize("threads", THREADS)
def test_the_error_of_a_world_is_raised_once_the_others_have_stepped(
    make: Callable[[], list[World]], threads: int
) -> None:
    with Worlds(make(), threads=threads) as worlds:
        worlds.reset()
        worlds[0].data.qvel[0] = np.nan
        with pytest.raises(PhysicsError, match=r"not finite|warned"):
            worlds.step([Move(1.0)] * 4)
        assert [round(world.observation().time, 6) for world in worlds][1:] == [0.04] * 3


def test_after_closing_the_worlds_live_on(make: Callable[[], list[World]]) -> None:
    worlds = Worlds(make(), threads=2)
    worlds.close()
    worlds.close()
    worlds[2].step(Move(1.0))
    assert len(worlds.step([Move(1.0)] * 4)) == 4


def test_what_cannot_be_stepped_is_named(make: Callable[[], list[World]]) -> None:
    mine = make()
    for wrong, threads, message in (
        (mine, 0, "threads is 0"),
        ([], 1, "0 worlds to step"),
        ([mine[0], mine[0]], 1, "all different"),
    ):
        with pytest.raises(ActionError, match=message):
            Worlds(wrong, threads=threads)
    worlds = Worlds(mine)
    with pytest.raises(ActionError, match="3 actions for 4 worlds"):
        worlds.step([Move()] * 3)
    with pytest.raises(ActionError, match="1 arrays of moves for 4 worlds"):
        worlds.walk([np.zeros((1, 4))])
