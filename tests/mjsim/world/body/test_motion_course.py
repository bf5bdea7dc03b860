"""Motions step by step: where the person faces and looks, where the load is, and when a motion ends."""

import math
from dataclasses import dataclass
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_worlds import do, scene_of, walk_to, world_of

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.scene.avatar import LEFT, RIGHT
from mjsim.values.actions import IDLE, EventKind, Pick, Place
from mjsim.values.options import FIDELITIES, REST_STEPS
from mjsim.world.body import hand_motions
from mjsim.world.body.hand_motions import square_heading
from mjsim.world.body.motion_profiles import ACROSS_FIRST, UP_FIRST
from mjsim.world.body.rig import LOOK

QUARTER = math.pi / 2
tiers = pytest.mark.parametrize("fidelity", FIDELITIES)


@dataclass(frozen=True)
class Step:
    """The state after one control step of a motion."""

    time: float
    heading: float
    look: float  # commanded pitch, rad
    eye: np.ndarray
    load: np.ndarray  # centre of mass of the object, m
    speed: float  # of the object, m/s
    quiet: bool  # the object is slow or asleep
    held: bool  # a weld holds the object
    events: tuple


def course(world, action, item=0):
    """Every control step of a pick or a place, from the first one to the one that ends it."""
    index, steps = world.scene.index, []
    body, dof, tree = index.bodies[item], index.dofs[item], index.trees[item]
    while not steps or world.busy:
        result = world.step(IDLE if steps else action)
        o, data = result.observation, world.data
        speed = float(np.linalg.norm(data.qvel[dof : dof + 3]))
        steps.append(
            Step(
                o.time,
                o.heading,
                float(world.body[LOOK]),
                o.eye,
                data.xipos[body].copy(),
                speed,
                speed < world.options.settle_speed or not data.tree_awake[tree],
                bool(data.eq_active.any()),
                tuple(e.kind for e in result.events),
            )
        )
        assert len(steps) < 400, "the motion does not end"
    return steps


def towards(step, point):
    """Direction from the eye to a point: azimuth and pitch, rad."""
    dx, dy, dz = (point - step.eye).tolist()
    return math.atan2(dy, dx), math.atan2(dz, math.hypot(dx, dy))


def beside_the_crate(catalogue, fidelity, heading=QUARTER, aside=0.0):
    """Somebody with a cube in the hand, south-east of the crate, who stands still."""
    x, y = 0.9, 3.0
    place = x + 0.7 * math.cos(heading - aside), y + 0.7 * math.sin(heading - aside)
    world = world_of(scene_of(catalogue, (x, y, heading), ("cube", *place), height=0.001), fidelity)
    assert [e.kind for e in do(world, Pick())] == [EventKind.PICKED]
    return world


def placed(world):
    steps = course(world, Place())
    assert steps[-1].events == (EventKind.PLACED,)
    return steps


@given(
    x=st.floats(-3.0, 3.0), y=st.floats(-3.0, 3.0), heading=st.floats(-20.0, 20.0), side=st.floats(-math.pi, math.pi),
    hand=st.sampled_from([LEFT, RIGHT]), loaded=st.booleans(),
)  # fmt: skip
def test_the_heading_for_a_place_is_square_to_the_bin_and_does_not_make_loaded_hands_cross(
    x, y, heading, side, hand, loaded
):
    """It faces the bin as directly as possible. With two loads, a bin is at most 30 degrees to the wrong side."""
    c, s = math.cos(side), math.sin(side)
    bin_ = SimpleNamespace(
        center=np.array([x, y, 0.2]), rotation=np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    )
    direction = math.atan2(y, x)
    rig = SimpleNamespace(heading=heading, bearing=lambda _: math.remainder(direction - heading, math.tau))
    held = [0, 0] if loaded else [0 if hand == LEFT else None, 0 if hand == RIGHT else None]
    found = square_heading(SimpleNamespace(rig=rig, held=held), hand, bin_)
    assert math.remainder(found - side, QUARTER) == pytest.approx(0.0, abs=1e-9)
    assert abs(found - heading) <= math.pi + 1e-9
    across = math.remainder(direction - found, math.tau) * (-1 if hand == LEFT else 1)
    if loaded:
        assert -math.pi / 3 - 1e-9 <= across <= math.pi / 6 + 1e-9
    else:
        assert abs(across) <= QUARTER / 2 + 1e-9


@tiers
@pytest.mark.parametrize("heading", [QUARTER, 0.3, -2.5])
def test_a_load_goes_down_into_the_bin_by_a_person_who_stands_square_to_it_and_looks_at_it(
    small_catalogue, fidelity, heading
):
    world = beside_the_crate(small_catalogue, fidelity, heading, aside=0.5)
    crate, motion = world.scene.receptacles["crate"], world.scene.person.motion
    steps = placed(world)
    rim = crate.center[2] + crate.half_size[2]
    descent = [s for k, s in enumerate(steps) if s.load[2] < rim and (fidelity == "event" or s.held)]
    assert descent
    for step in descent[:2]:
        assert abs(math.remainder(step.heading - QUARTER, math.tau)) < motion.receptacle_tolerance
        assert step.look == pytest.approx(towards(step, crate.center)[1], abs=0.05)


@pytest.mark.parametrize(("height", "order"), [(0.1, UP_FIRST), (1.2, ACROSS_FIRST)])
def test_an_object_is_lifted_off_the_floor_but_drawn_off_a_high_shelf(height, order):
    orders = []
    person = SimpleNamespace(
        rig=SimpleNamespace(hand_targets=np.array([[0.6, 0.0, height]] * 2)),
        motion=SimpleNamespace(align_time=0.1, lift_time=0.5),
        steps=lambda _: 1,
        swing=lambda _hand, _goal, _steps, order: orders.append(order) or iter(()),
    )
    assert len(list(hand_motions._lift(person, 0, np.array([0.5, 0.24, 1.1]), 0.0))) == 1
    assert orders == [order]


def test_a_hand_that_is_already_over_its_slot_takes_no_step(small_catalogue):
    person = beside_the_crate(small_catalogue, "full")._tier.person
    nearest = person.motion.least_travel
    assert person.travel_steps(0.99 * nearest) == 0
    assert person.travel_steps(1.01 * nearest) == person.steps(
        person.motion.start_time + 1.01 * nearest / person.motion.travel_speed
    )


@tiers
def test_a_load_moves_sideways_before_it_moves_forward_so_that_it_passes_furniture_beside_the_bin(
    small_catalogue, fidelity
):
    steps = placed(beside_the_crate(small_catalogue, fidelity))
    loads = np.array([step.load for step in steps])
    sideways, forward = abs(loads[:, 0] - loads[-1, 0]), loads[:, 1] - loads[0, 1]
    assert sideways[0] > 0.2 and forward[-1] > 0.05
    assert np.all(sideways[forward > 0.02] < 0.02)


@tiers
def test_the_gaze_goes_to_the_bin_while_the_load_travels_and_returns_after_the_release(
    small_catalogue, fidelity
):
    """The person already stands square to the bin, so that the whole change of the gaze is part of the travel."""
    world = beside_the_crate(small_catalogue, fidelity)
    before = float(world.body[LOOK])
    crate = world.scene.receptacles["crate"]
    steps = placed(world)
    assert max(abs(s.heading - QUARTER) for s in steps) < 0.02
    off = [abs(s.look - towards(s, crate.center)[1]) for s in steps]
    lowest = int(np.argmin([s.look for s in steps]))
    assert off[0] > 0.5 and off[lowest] < 0.05
    assert np.all(np.diff(off[: lowest - 3]) < 1e-3), "it never turns away on the way"
    back = [abs(s.look - before) for s in steps[lowest:]]
    assert back[-1] < back[0] - 0.3 and np.all(np.diff(back) < 1e-9)


@tiers
def test_the_gaze_follows_a_reach_and_returns_while_the_object_is_lifted(small_catalogue, fidelity):
    scene = scene_of(small_catalogue, (1.5, 2.0, 0.0), ("cube", 2.2, 2.0))
    world = world_of(scene, fidelity)
    before = float(world.body[LOOK])
    steps = course(world, Pick())
    assert steps[-1].events == (EventKind.PICKED,)
    off = [abs(s.look - towards(s, steps[0].load)[1]) for s in steps]
    lowest = int(np.argmin([s.look for s in steps]))
    assert off[0] > 0.8 and off[lowest] < 0.25
    assert steps[lowest].load[2] < 0.2, "the object is still on the floor"
    assert steps[-1].look == pytest.approx(before, abs=0.02)


def test_a_place_ends_as_soon_as_the_object_has_rested(small_catalogue):
    for heading in (QUARTER, 0.3):
        steps = placed(beside_the_crate(small_catalogue, "full", heading, aside=0.5))
        released = next(k for k, s in enumerate(steps) if not s.held)
        quiet = [s.quiet for s in steps[released:-1]]
        runs = [all(quiet[k - REST_STEPS : k]) for k in range(REST_STEPS, len(quiet) + 1)]
        assert runs == [False] * (len(runs) - 1) + [True]


@tiers
def test_motions_take_as_long_as_their_parts(small_catalogue, fidelity):
    """A pick without a turn is a reach, a pause and a lift; a place is a travel, a pause, a descent and a fall."""
    world = world_of(scene_of(small_catalogue, (1.5, 2.0, 0.0), ("cube", 2.2, 2.0)), fidelity)
    motion, began = world.scene.person.motion, world.observation().time
    pick = course(world, Pick())[-1].time - began
    parts = motion.reach_time + motion.align_time + motion.lift_time
    assert parts <= pick < parts + 0.4
    world = beside_the_crate(small_catalogue, fidelity)
    began = world.observation().time
    place = placed(world)[-1].time - began
    assert 1.0 < place < 2.5


def test_the_size_of_a_load_is_that_of_its_farthest_corner_from_the_grip(tmp_path, fresh_house):
    """An object that tapers to the top, where the hand holds it."""
    wedge = tmp_path / "wedge.xml"
    text = wedge.read_text(encoding="utf-8")
    assert "-.08 -.05 .08 -.08 .05 .08" in text
    tapered = text.replace("-.08 -.05 .08 -.08 .05 .08", "-.02 -.01 .08 .02 .01 .08")
    wedge.write_text(tapered, encoding="utf-8")
    catalogue = Catalogue.load(str(fresh_house))
    world = world_of(scene_of(catalogue, (1.0, 2.8, 1.5), ("wedge", 1.6, 1.8), ("ball", 1.0, 2.0)))
    expected = [(math.hypot(0.08, 0.05), 0.08), (math.hypot(0.06, 0.06), 0.12)]
    assert world._tier.carrying.loads == pytest.approx(np.array(expected), abs=1e-6)


@tiers
@pytest.mark.parametrize("doorway", [1.78, 2.22])
def test_loads_stay_clear_of_walls_and_of_each_other_through_a_doorway(small_catalogue, fidelity, doorway):
    placed_ = ("cube", 1.6, 1.3), ("wedge", 1.6, 0.7)
    world = world_of(scene_of(small_catalogue, (1.0, 1.0, 0.0), *placed_), fidelity)
    for name in ("o0", "o1"):
        assert [e.kind for e in do(world, Pick(name))] == [EventKind.PICKED]
    step, gaps = world.step, []

    def measured(action, **options):
        result = step(action, **options)
        gaps.append(gap_to_house(world))
        return result

    world.step = measured
    walk_to(world, 2.2, doorway)
    walk_to(world, 3.9, doorway)
    assert min(gaps) > -0.002  # the clearance is interpolated on a grid
    assert max(gaps) > 0.3
    assert world.observation().carried == ("o0", "o1")


def gap_to_house(world):
    """Least distance between what is carried and the walls, m."""
    model, data, ends = world.model, world.data, np.zeros(6)
    walls = [
        model.geom(n).id for n in ("partition_south", "partition_north", "lintel", "south", "north", "west")
    ]
    loads = np.flatnonzero(world.scene.index.geom_owner >= 0)
    pairs = ((int(a), b) for a in loads for b in walls)
    return min(mujoco.mj_geomDistance(model, data, a, b, 1.0, ends) for a, b in pairs)
