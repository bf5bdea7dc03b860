"""One set of numbers moves the person in every tier of fidelity."""

import dataclasses
import math

import numpy as np
import pytest

from mjsim.actions import IDLE, Move, Pick, Place
from mjsim.episode import Episode, PlacedObject, StartPose
from mjsim.model.catalogue import Catalogue
from mjsim.model.scene import Scene, compose
from mjsim.motion_parameters import MotionParameters
from mjsim.options import FIDELITIES, WorldOptions
from mjsim.person_parameters import PersonParameters
from mjsim.world import World

CHANGED = MotionParameters(
    turn_gain=2.0,
    turn_timeout=0.12,
    object_tolerance=0.02,
    receptacle_tolerance=0.8,
    standing_speed=5.0,
    standing_turn_rate=0.02,
    look_gain=0.1,
    look_speed=0.3,
    reach_time=0.64,
    align_time=0.32,
    lift_time=0.84,
    lead=0.4,
    start_time=0.32,
    least_travel=5.0,
    travel_speed=0.3,
    descent_speed=0.25,
    hover_gap=0.1,
    hover_time=0.28,
    release_gap=0.02,
    withdraw_steps=2,
    withdraw_step=0.01,
    posture_gain=3.0,
    posture_speed=0.4,
    posture_acceleration=3.0,
)
LATER = 5  # control steps, for the times that are 0.2 s longer in `CHANGED`
LONGER = {
    "reach_time": (LATER, 0),
    "align_time": (LATER, 0),
    "lift_time": (LATER, 0),
    "hover_time": (0, LATER),
}


@pytest.fixture(scope="module")
def scene(small_catalogue: Catalogue) -> Scene:
    """A cube in reach of somebody who stands in reach of its receptacle."""
    turn = (math.cos(0.7), 0.0, 0.0, math.sin(0.7))
    cube = PlacedObject("o0", "solids", "cube", (1.3, 2.6), (1.3, 2.6, 0.001), turn)
    targets = {"o0": small_catalogue.categories["solids"].receptacle}
    keys = tuple(small_catalogue.receptacles)
    start = StartPose(0.9, 3.0, -0.8)
    return compose(Episode(small_catalogue.name, 0, start, (cube,), keys, targets), small_catalogue)


def transport(scene: Scene, fidelity: str) -> tuple[int, int, np.ndarray]:
    """Control steps of a pick and of a place that begin while the person walks and turns, and all poses meanwhile."""
    world = World(scene, WorldOptions(fidelity=fidelity))
    steps, rows = [], []
    for action in (Pick("o0"), Place("o0")):
        for _ in range(5):
            world.step(Move(0.0, 0.6, 0.6, 0.5))
        taken = 0
        while taken == 0 or world.busy:
            world.step(action if taken == 0 else IDLE)
            rows.append(world.data.qpos.copy())
            taken += 1
        steps.append(taken)
    return steps[0], steps[1], np.array(rows)


@pytest.fixture(scope="module")
def usual(scene: Scene) -> dict[str, tuple[int, int, np.ndarray]]:
    return {fidelity: transport(scene, fidelity) for fidelity in FIDELITIES}


@pytest.mark.parametrize("name", MotionParameters._fields)
def test_every_tier_moves_by_the_same_numbers(
    scene: Scene,
    usual: dict[str, tuple[int, int, np.ndarray]],
    name: str,
) -> None:
    changed = scene.person.motion._replace(**{name: getattr(CHANGED, name)})
    scene = dataclasses.replace(scene, person=PersonParameters(motion=changed))
    for fidelity, (pick, place, poses) in usual.items():
        other_pick, other_place, other_poses = transport(scene, fidelity)
        assert not np.array_equal(poses, other_poses), f"{fidelity} does not move by `{name}`"
        if name in LONGER:
            longer = (other_pick - pick, other_place - place)
            # In physics the hand lags less behind a slow reach, and waits less for it.
            slack = 2 if (fidelity, name) == ("full", "reach_time") else 0
            assert longer == pytest.approx(LONGER[name], abs=slack), fidelity
