"""Each number of how a person carries changes where the hands go, and by as much as it says."""

import math

import numpy as np
import pytest

from mjsim.actions import Move, Pick
from mjsim.episode import Episode, PlacedObject, StartPose
from mjsim.model.catalogue import Catalogue
from mjsim.model.clearance import ClearanceField
from mjsim.model.scene import Scene, compose
from mjsim.motion_parameters import CarryingParameters
from mjsim.options import FIDELITIES, WorldOptions
from mjsim.person.load_room import BodyMotion, drawn_in
from mjsim.person.postures import Contacts, Hands, Holding, update_hands
from mjsim.person_parameters import PersonParameters
from mjsim.world import World

USUAL = CarryingParameters()
OTHER = CarryingParameters(
    least_height=1.1,
    margin=0.06,
    near=0.05,
    far=0.6,
    most_shift=0.02,
    stacking_gap=0.1,
    stacking_distance=0.3,
    push_back=0.1,
    return_rate=5.0,
    most_compliance=0.01,
)
PACE = np.array([50.0, 10.0, 100.0])  # at once
DT = 0.04


def corridor(width: float) -> ClearanceField:
    """Clearance between two walls along x, in cells of 1 cm about the origin."""
    y = (np.arange(400) - 199.5) * 0.01
    room = 0.5 * width - np.abs(y)
    gradient = np.zeros((400, 400, 2))
    gradient[..., 1] = -np.sign(y)
    return ClearanceField(np.tile(room, (400, 1)), gradient, -1.995, -1.995, 0.01)


def goals(carrying: CarryingParameters, width: float = 1.4, touching: bool = True) -> np.ndarray:
    """Where the hands want to be after ten control steps of walking and turning with two loads, (2, 3)."""
    command = np.array([0.8, 0.3, 0.5, 0.0])
    body = BodyMotion(np.array([0.0, 0.1, 0.3] + 7 * [0.0]), command, corridor(width))
    found = Hands(
        np.array([[0.3, 0.2, 1.0], [0.3, -0.2, 1.0]]), np.zeros((2, 3)), np.zeros((2, 2)), np.zeros((2, 3)),
        np.array([0.1, 0.25, 0.8]), np.array([[0.15, 0.12], [0.14, 0.1]]), PACE,
    )  # fmt: skip
    frames = np.array([[0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]])
    if touching:
        contacts = Contacts(np.array([[0, 1]], np.int32), frames, np.array([0, -1], np.int32))
    else:
        contacts = Contacts(np.zeros((0, 2), np.int32), frames[:0], np.zeros(0, np.int32))
    for _ in range(10):
        update_hands(body, found, carrying, Holding(0, 1, -1, np.array([0.32, 0.15, 1.0])), contacts, DT)
    return found.goals


@pytest.mark.parametrize("name", CarryingParameters._fields)
def test_every_number_changes_where_the_hands_go(name: str) -> None:
    other = USUAL._replace(**{name: getattr(OTHER, name)})
    cases = [(width, touching) for width in (0.5, 0.7, 0.9, 4.0) for touching in (True, False)]
    assert any(not np.array_equal(goals(other, *case), goals(USUAL, *case)) for case in cases)


@pytest.mark.parametrize("margin", [0.0, 0.03, 0.1])
def test_a_load_keeps_the_margin_from_walls(margin: float) -> None:
    body = BodyMotion(np.array([0.0, 0.3] + 8 * [0.0]), np.zeros(3), corridor(1.2))
    _, left = drawn_in(0.3, 0.15, 0.1, body, USUAL._replace(margin=margin))
    assert 0.6 - (0.3 + left) - 0.1 == pytest.approx(margin, abs=0.011) or left == pytest.approx(0.15)


def test_a_hand_gives_way_no_farther_than_said() -> None:
    free = goals(USUAL, 4.0, touching=False)
    for limit in (0.05, 0.15):
        pushed = goals(USUAL._replace(most_compliance=limit, push_back=1.0), 4.0)
        assert math.dist(pushed[0, :2], free[0, :2]) == pytest.approx(limit, abs=0.2 * limit)


@pytest.fixture(scope="module")
def scene(small_catalogue: Catalogue) -> Scene:
    cube = PlacedObject("o0", "solids", "cube", (1.3, 2.6), (1.3, 2.6, 0.001), (1.0, 0.0, 0.0, 0.0))
    targets = {"o0": small_catalogue.categories["solids"].receptacle}
    episode = Episode(
        small_catalogue.name,
        0,
        StartPose(0.9, 3.0, -0.8),
        (cube,),
        tuple(small_catalogue.receptacles),
        targets,
    )
    person = PersonParameters(carrying=USUAL._replace(least_height=1.2))
    return compose(episode, small_catalogue, person=person)


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_every_tier_carries_at_the_persons_height(scene: Scene, fidelity: str) -> None:
    world = World(scene, WorldOptions(fidelity=fidelity))
    world.step(Pick("o0"))
    for _ in range(200):
        world.step(Move(turn=0.5))
    body = world.data.body(scene.model.body_rootid[scene.index.bodies[0]])
    low = min(
        world.data.geom_xpos[g][2] - scene.model.geom_rbound[g]
        for g in range(scene.model.ngeom)
        if scene.model.geom_bodyid[g] == body.id
    )
    assert low > 1.0
