"""Placing: footprints, slots by measured fill, and every outcome of letting go."""

import itertools
import math

import numpy as np
import pytest
from small_worlds import do, scene_of, world_of

from mjsim.house.compiled.footprint import ClearanceField, clearance_at
from mjsim.house.compiled.house import compiled_house
from mjsim.values.actions import IDLE, EventKind, Move, Pick, Place
from mjsim.values.observation import ObjectStatus
from mjsim.world.body.motion_profiles import ACROSS_FIRST, UP_FIRST, minimum_jerk, point_between
from mjsim.world.body.slots import object_corners


def tidy(catalogue, start, models, spots):
    """A world with things on the floor, each turned another way."""
    turns = [(math.cos(0.7 * i), 0.0, 0.0, math.sin(0.7 * i)) for i in range(len(models))]
    placed = [(model, *spot, turn) for model, spot, turn in zip(models, spots, turns, strict=True)]
    return world_of(scene_of(catalogue, start, *placed, height=0.001))


def transport(world, name):
    return [e.kind for e in do(world, Pick(name)) + do(world, Place(name))]


@pytest.mark.parametrize(("x", "y", "heading"), [(0.45, 2.9, 1.5), (1.0, 3.1, 2.4), (1.2, 3.7, -2.0)])
def test_four_objects_fill_the_four_slots(small_catalogue, x, y, heading):
    spots = [(x + 0.7 * math.cos(a), y + 0.7 * math.sin(a)) for a in (-0.3, -0.75, -1.2, -1.7)]
    world = tidy(small_catalogue, (x, y, heading), ["cube", "wedge", "cube", "wedge"], spots)
    for number in range(4):
        assert transport(world, f"o{number}") == [EventKind.PICKED, EventKind.PLACED]
    crate = world.scene.receptacles["crate"]
    local = (world.data.xipos[world.scene.index.bodies] - crate.center) @ crate.rotation
    assert (np.abs(local) < crate.half_size).all()
    assert {tuple(quadrant) for quadrant in np.sign(local[:, :2])} == set(
        itertools.product((-1, 1), repeat=2)
    )
    assert world.observation().names_with(ObjectStatus.DELIVERED) == ("o0", "o1", "o2", "o3")
    assert world.health.max_penetration_m < 0.01
    assert len(world.health.settle_times) == 4


@pytest.mark.parametrize("room", ["cramped_catalogue", "small_catalogue"])
def test_a_fifth_object_goes_beside_four_or_on_top_where_they_fill_the_floor(request, room):
    spots = [(1.0 + 0.6 * math.cos(a), 3.1 + 0.6 * math.sin(a)) for a in (0.4, -0.3, -0.9, -1.5, -2.1)]
    world = tidy(request.getfixturevalue(room), (1.0, 3.1, 2.4), ["cube"] * 5, spots)
    for number in range(5):
        assert transport(world, f"o{number}") == [EventKind.PICKED, EventKind.PLACED]
    heights = world.observation().object_positions[:, 2]
    assert heights[:4] == pytest.approx(0.04, abs=0.005)  # the crate's floor
    assert heights[4] > 0.1 if room == "cramped_catalogue" else heights[4] == pytest.approx(0.04, abs=0.005)


def test_a_ball_stays_where_it_is_put(small_catalogue):
    world = tidy(small_catalogue, (5.1, 3.1, 0.8), ["ball", "ball"], [(4.5, 3.0), (4.7, 2.6)])
    assert transport(world, "o0") == [EventKind.PICKED, EventKind.PLACED]
    assert transport(world, "o1") == [EventKind.PICKED, EventKind.PLACED]


def test_the_other_hand_is_left_in_peace(small_catalogue):
    world = tidy(small_catalogue, (0.9, 3.0, 2.3), ["cube", "ball"], [(1.3, 2.6), (0.9, 2.4)])
    do(world, Pick("o0"))
    do(world, Pick("o1"))
    before = world.observation().hands
    assert None not in before
    assert [e.kind for e in do(world, Place())] == [EventKind.PLACED]  # the one whose receptacle is near
    assert world.observation().carried == ("o1",)
    assert world.observation().hands.index("o1") == before.index("o1")
    assert world.health.max_weld_error_m < 0.009


def test_the_person_may_go_on_at_once(small_catalogue):
    world = tidy(small_catalogue, (0.9, 3.0, 2.3), ["cube"], [(1.3, 2.6)])
    transport(world, "o0")
    for _ in range(50):
        world.step(Move(forward=-1.0))
    assert world.observation().object_status == (ObjectStatus.DELIVERED,)


def test_an_object_that_cannot_stay_is_loose_again(small_catalogue):
    """It is whisked away at the moment of release, so that it does not come to rest inside."""
    world = tidy(small_catalogue, (0.9, 3.0, 2.3), ["cube"], [(1.3, 2.6)])
    do(world, Pick("o0"))
    world.step(Place())
    events = []
    moved = False
    address = int(world.scene.index.qpos[0])
    while world.busy:
        events += world.step(IDLE).events
        if not moved and not world.data.eq_active.any():
            world.data.qpos[address : address + 3] = (1.4, 2.4, 0.3)
            moved = True
    assert [e.kind for e in events[:-1]] == [
        EventKind.TUNNELLED,
        EventKind.EJECTED,
    ]  # through the crate, and far
    assert (events[-1].kind, events[-1].receptacle) == (EventKind.PLACE_FAILED, "crate")
    assert world.observation().object_status == (ObjectStatus.LOOSE,)
    assert world.observation().hands == (None, None)
    assert [e.kind for e in do(world, Pick("o0"))] == [EventKind.PICKED]


MODELS_PER_RUN = 4


@pytest.mark.slow
@pytest.mark.parametrize("category", ["dishes", "toys", "books", "laundry", "office", "recycling"])
def test_every_model_of_the_apartment_goes_into_its_receptacle(catalogue, category):
    models = list(catalogue.categories[category].objects)
    models += models[: -len(models) % MODELS_PER_RUN]
    key = catalogue.categories[category].receptacle
    geometry = compiled_house(catalogue).receptacles[key]
    out = geometry.approach - geometry.center[:2]
    out /= np.linalg.norm(out)
    side = np.array([-out[1], out[0]])
    spots = [
        tuple(geometry.approach + a * out + b * side)
        for a, b in ((0.25, 0.35), (0.25, -0.35), (0.5, 0.2), (0.5, -0.2))
    ]
    start = (*geometry.approach, math.atan2(-out[1], -out[0]))
    for first in range(0, len(models), MODELS_PER_RUN):
        batch = models[first : first + MODELS_PER_RUN]
        world = tidy(catalogue, start, batch, [(float(x), float(y)) for x, y in spots])
        for number in range(MODELS_PER_RUN):
            assert transport(world, f"o{number}") == [EventKind.PICKED, EventKind.PLACED], batch[number]
        assert world.health.max_penetration_m < 0.01, batch
        assert max(world.health.settle_times) < 1.0


def test_corners_enclose_every_vertex(small_catalogue):
    scene = scene_of(small_catalogue, (1.0, 1.0, 0.0), ("wedge", 1.5, 1.0), ("cube", 1.0, 2.0))
    for name, low, high in (
        ("o0", (-0.08, -0.05, 0.0), (0.08, 0.05, 0.08)),
        ("o1", (-0.05, -0.05, 0.0), (0.05, 0.05, 0.1)),
    ):
        corners = object_corners(scene.model, scene.index.geoms(name))
        assert corners.min(axis=0) == pytest.approx(low, abs=1e-6)
        assert corners.max(axis=0) == pytest.approx(high, abs=1e-6)


def test_clearance_is_the_distance_to_the_walls(small_catalogue):
    model = scene_of(small_catalogue, (1.0, 1.0, 0.0)).model
    field = ClearanceField.from_model(model, low=0.93, high=1.6)
    # West room: walls at x = 0, y = 0, y = 4 and, beside the doorway, x = 2.95. The crate is too low to count.
    for x, y in ((0.5, 1.0), (1.5, 0.4), (0.3, 3.5), (2.6, 0.7), (1.4, 1.3)):
        room, away_x, away_y = clearance_at(x, y, field)
        walls = {(1, 0): x, (0, 1): y, (0, -1): 4.0 - y, (-1, 0): 2.95 - x}
        direction = min(walls, key=lambda d: walls[d])
        assert room == pytest.approx(walls[direction], abs=0.04)
        assert (away_x, away_y) == pytest.approx(direction, abs=0.2)
    assert clearance_at(3.0, 0.7, field)[0] < 0.0
    assert clearance_at(3.0, 2.0, field)[0] == pytest.approx(0.5, abs=0.05)


def test_minimum_jerk_starts_and_ends_at_rest():
    phases = np.linspace(0.0, 1.0, 1001)
    progress = np.array([minimum_jerk(p) for p in phases])
    assert (progress[0], progress[500], progress[-1]) == pytest.approx((0.0, 0.5, 1.0))
    assert (np.diff(progress) >= 0).all()
    speed = np.gradient(progress, phases)
    assert speed[[0, -1]] == pytest.approx(0.0, abs=1e-4)
    assert speed.max() == pytest.approx(1.875, abs=1e-3)
    assert (minimum_jerk(-1.0), minimum_jerk(2.0)) == (0.0, 1.0)


def test_a_lift_goes_up_before_it_goes_across():
    start, goal = np.zeros(3), np.array([1.0, 1.0, 1.0])
    up = [point_between(start, goal, p, UP_FIRST, 0.2) for p in np.linspace(0, 1, 21)]
    down = [point_between(start, goal, p, ACROSS_FIRST, 0.2) for p in np.linspace(0, 1, 21)]
    assert up[0] == pytest.approx(start) and up[-1] == pytest.approx(goal)
    assert all(p[2] >= p[0] == p[1] for p in up) and up[8][2] > 2 * up[8][0]
    assert all(p[2] <= p[0] == p[1] for p in down)


def test_gravity_alone_moves_nothing_that_was_delivered(small_catalogue):
    world = tidy(small_catalogue, (0.9, 3.0, 2.3), ["cube", "cube"], [(1.3, 2.6), (0.9, 2.4)])
    transport(world, "o0")
    transport(world, "o1")
    for _ in range(100):
        assert world.step(IDLE).events == ()
    bodies = world.scene.index.trees
    assert not world.data.tree_awake[bodies].any()
