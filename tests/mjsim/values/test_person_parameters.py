"""What differs from person to person stands once: every tier, the planner, the percept and the picture follow it."""

import dataclasses
import itertools
import math

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_worlds import scene_of, world_of

from experiments.house import WALL_GAP
from mjsim.house.compiled.footprint import ClearanceField
from mjsim.house.scene import avatar
from mjsim.house.sight.sight import FieldOfView, visible_objects
from mjsim.render.cameras import camera_pose
from mjsim.values.actions import IDLE, Move, Pick, Place
from mjsim.values.errors import PersonError
from mjsim.values.motion_parameters import GROUP_RANGES, CarryingParameters, MotionParameters
from mjsim.values.options import FIDELITIES
from mjsim.values.person_parameters import RANGES, PersonParameters
from mjsim.world.body.load_room import BodyMotion, drawn_in
from mjsim.world.body.postures import Contacts, Hands, Holding, update_hands

USUAL = PersonParameters()
# Control steps that a pick and a place take longer where a time is 0.2 s longer.
LONGER = {"reach_time": (5, 0), "align_time": (5, 0), "lift_time": (5, 0), "hover_time": (0, 5)}
PACE = np.array([50.0, 10.0, 100.0])  # at once
AHEAD = 0.8  # m from the person to the cube, straight ahead


def before_a_cube(catalogue, person):
    """Somebody in the middle of a room, who looks at a cube."""
    return scene_of(catalogue, (1.5, 2.0, 0.0), ("cube", 1.5 + AHEAD, 2.0), person=person)


def walked(world, *move, steps):
    """Positions, headings and pitches, (steps + 1, 4), under one move after the other."""
    rows = [world.observation()]
    rows += [world.step(Move(*move)).observation for _ in range(steps)]
    return np.array([(*o.position, o.heading, o.pitch) for o in rows])


def rate(world, column, *move, steps):
    """How fast a column of `walked` changes at the end, per second."""
    rows = walked(world, *move, steps=steps)[:, column]
    return float(abs(rows[-1] - rows[-3]) / (2 * world.control_timestep))


def time_to(world, column, share, *move):
    """Seconds until a column of `walked` changes at a share of the wanted rate."""
    rows = walked(world, *move, steps=40)[:, column]
    rates = np.diff(rows) / world.control_timestep
    return float(np.argmax(rates > share * rates.max()) * world.control_timestep)


def gap_to_wall(world):
    """Distance of the body's axis from the wall y = 0 after walking at it, m."""
    return float(walked(world, 0.0, -1.0, 0.0, steps=90)[-1, 1])


def reaches(world):
    result = world.step(Pick("o0")).result
    assert result is not None
    return result.applied


def sees(world, turned=0.0):
    """Whether the cube is in view for somebody turned by an angle, rad."""
    return visible_objects(world.scene, world.data, world.observation().eye, turned, -0.6) == ("o0",)


MOVES = {
    "walking_speed": (0.8, lambda w: rate(w, 1, 0.0, 9.0, 0.0, steps=30),
        lambda p: p.walking_speed * 14 / 13),
    "walking_acceleration": (1.0, lambda w: time_to(w, 1, 0.5, 0.0, 1.0),
        lambda p: 0.5 / p.walking_acceleration),
    "turning_speed": (1.2, lambda w: rate(w, 2, 0.0, 0.0, 9.0, steps=30), lambda p: p.turning_speed),
    "turning_acceleration": (4.0, lambda w: time_to(w, 2, 0.5, 0.0, 0.0, 2.0),
        lambda p: 1.0 / p.turning_acceleration),
    "looking_speed": (0.5, lambda w: rate(w, 3, 0.0, 0.0, 0.0, 9.0, steps=12), lambda p: p.looking_speed),
    "body_radius": (0.12, gap_to_wall, lambda p: p.body_radius),
    "eye_height": (1.2, lambda w: w.observation().eye[2], lambda p: p.eye_height),
}  # fmt: skip


@pytest.mark.parametrize("fidelity", FIDELITIES)
@pytest.mark.parametrize("name", MOVES)
def test_every_tier_moves_by_the_persons_numbers(small_catalogue, name, fidelity):
    other, measure, expected = MOVES[name]
    for value in (getattr(USUAL, name), other):
        person = dataclasses.replace(USUAL, **{name: value})
        found = measure(world_of(before_a_cube(small_catalogue, person), fidelity))
        assert found == pytest.approx(expected(person), rel=0.03, abs=0.06), f"{name} = {value}"


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_every_tier_reaches_and_sees_as_far_as_the_person(small_catalogue, fidelity):
    def world(**values):
        return world_of(before_a_cube(small_catalogue, PersonParameters(**values)), fidelity)

    assert reaches(world(reach=AHEAD + 0.05)) and not reaches(world(reach=AHEAD - 0.05))
    assert sees(world(), 0.5) and not sees(world(field_of_view=0.5), 0.5)
    assert sees(world()) and not sees(world(viewing_distance=1.0))


def test_nothing_of_a_person_is_left_out():
    """The values that no test above measures are those of participants (participants/test_people.py)."""
    elsewhere = {"reach", "field_of_view", "viewing_distance", "looking_interval", "reading_time", "patience"}
    assert {*MOVES, *elsewhere} == set(RANGES)


def test_planned_paths_keep_clear_of_walls_by_the_persons_size(house):
    slim = house.for_person(PersonParameters(body_radius=0.12, reach=0.8))
    assert slim.navmesh.agent_radius == pytest.approx(0.12 + WALL_GAP)
    assert slim.body_geodesics.navmesh.agent_radius == 0.12
    assert slim.geodesics.max_snap == 0.8
    assert slim.navmesh.area > house.navmesh.area
    assert slim.sample_episode(objects=6, seed=1) == house.sample_episode(objects=6, seed=1)
    assert house.for_person(PersonParameters(walking_speed=0.5)) is house


@pytest.mark.slow
@given(st.floats(0.5, 2.4), st.sampled_from([(640, 480), (960, 720), (1920, 1080), (480, 640)]))
def test_pictures_of_any_shape_are_as_wide_as_the_percept(field, size):
    """Half the picture is as wide, at distance 1, as the frustum in which a participant sees."""
    person = PersonParameters(field_of_view=field)
    spec = mujoco.MjSpec()
    avatar.attach_avatar(spec, (), start=(0.0, 0.0, 0.0), person=person)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    aspect = size[0] / size[1]
    pose, percept = camera_pose(model, data, avatar.EYE, aspect), FieldOfView.of(person)
    assert math.tan(pose.fovy / 2) * aspect == pytest.approx(math.tan(percept.horizontal / 2))
    if aspect == pytest.approx(4 / 3):
        assert pose.fovy == pytest.approx(percept.vertical)


def test_the_usual_picture_is_70_degrees_high(scene):
    assert scene.model.cam(avatar.EYE).fovy[0] == 70.0


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"walking_speed": 0}, r"walking_speed must be 0\.1 to 8 m/s, got 0"),
        ({"reach": math.nan}, r"reach must be .* got nan"),
        ({"reach": "far"}, r"reach must be .* got 'far'"),
        ({"reading_time": True}, r"reading_time must be .* got True"),
        ({"field_of_view": 90}, r"field_of_view must be .* got 90; 90 degrees are 1\.571 rad"),
        ({"motion": MotionParameters(lift_time=-1.0)}, r"motion\.lift_time must be .* got -1\.0"),
        (
            {"motion": MotionParameters(withdraw_steps=2.5)},
            r"withdraw_steps must be a whole number, got 2\.5",
        ),
    ],
)
def test_impossible_people_are_named(values, message):
    with pytest.raises(PersonError, match=message):
        PersonParameters(**values)


def test_whole_numbers_do_not_compile_kernels_anew():
    person = PersonParameters(walking_speed=1, motion=MotionParameters(hover_time=1))
    assert [type(v) for v in (person.walking_speed, person.motion.hover_time)] == [float, float]
    assert type(person.motion.withdraw_steps) is int


def test_a_person_comes_back_from_its_values():
    person = PersonParameters(reach=0.7, motion=MotionParameters(withdraw_steps=2))
    assert PersonParameters.from_dict(person.as_dict()) == person
    with pytest.raises(PersonError, match="a person has the values"):
        PersonParameters.from_dict({**person.as_dict(), "age": 30})
    with pytest.raises(PersonError, match="motion has the values"):
        PersonParameters.from_dict({**person.as_dict(), "motion": {}})


def in_reach(catalogue, person=None):
    """A cube in reach of a person who is in reach of its receptacle."""
    cube = ("cube", 1.3, 2.6, (math.cos(0.7), 0.0, 0.0, math.sin(0.7)))
    return scene_of(catalogue, (0.9, 3.0, -0.8), cube, height=0.001, person=person)


def transport(scene, fidelity):
    """Control steps of a pick and of a place that begin while the person walks and turns, and all poses meanwhile."""
    world = world_of(scene, fidelity)
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
def usual(small_catalogue):
    scene = in_reach(small_catalogue)
    return scene, {fidelity: transport(scene, fidelity) for fidelity in FIDELITIES}


def at_the_ends(group, name):
    """A person's usual numbers of a group, but for one that is as small, or as large, as it may be."""
    for end in GROUP_RANGES.get(f"{group}.{name}", (1e-4, 10.0)):
        yield getattr(USUAL, group)._replace(**{name: end})


@pytest.mark.parametrize("name", MotionParameters._fields)
def test_every_tier_moves_by_the_same_numbers(usual, name):
    scene, transports = usual
    for fidelity, (_, _, poses) in transports.items():
        people = (PersonParameters(motion=motion) for motion in at_the_ends("motion", name))
        others = (transport(dataclasses.replace(scene, person=other), fidelity)[2] for other in people)
        assert any(not np.array_equal(poses, other) for other in others), fidelity


@pytest.mark.parametrize("name", LONGER)
def test_times_of_a_motion_last_as_long_as_they_say(usual, name):
    scene, transports = usual
    motion = USUAL.motion._replace(**{name: getattr(USUAL.motion, name) + 0.2})
    scene = dataclasses.replace(scene, person=PersonParameters(motion=motion))
    for fidelity, (pick, place, _) in transports.items():
        other_pick, other_place, _ = transport(scene, fidelity)
        # In physics the hand lags less behind a slow reach, and waits less for it.
        slack = 2 if (fidelity, name) == ("full", "reach_time") else 0
        assert (other_pick - pick, other_place - place) == pytest.approx(LONGER[name], abs=slack), fidelity


def corridor(width):
    """Clearance between two walls along x, in cells of 1 cm about the origin."""
    y = (np.arange(400) - 199.5) * 0.01
    room = 0.5 * width - np.abs(y)
    gradient = np.zeros((400, 400, 2))
    gradient[..., 1] = -np.sign(y)
    return ClearanceField(np.tile(room, (400, 1)), gradient, -1.995, -1.995, 0.01)


def goals(carrying, width=1.4, touching=True):
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
        update_hands(body, found, carrying, Holding(0, 1, -1, np.array([0.32, 0.15, 1.0])), contacts, 0.04)
    return found.goals


@pytest.mark.parametrize("name", CarryingParameters._fields)
def test_every_number_changes_where_the_hands_go(name):
    cases = itertools.product(at_the_ends("carrying", name), (0.5, 0.7, 0.9, 4.0), (True, False))
    assert any(
        not np.array_equal(goals(other, *case), goals(USUAL.carrying, *case)) for other, *case in cases
    )


@pytest.mark.parametrize("margin", [0.0, 0.03, 0.1])
def test_a_load_keeps_the_margin_from_walls(margin):
    body = BodyMotion(np.array([0.0, 0.3] + 8 * [0.0]), np.zeros(3), corridor(1.2))
    _, left = drawn_in(0.3, 0.15, 0.1, body, USUAL.carrying._replace(margin=margin))
    assert 0.6 - (0.3 + left) - 0.1 == pytest.approx(margin, abs=0.011) or left == pytest.approx(0.15)


def test_a_hand_gives_way_no_farther_than_said():
    free = goals(USUAL.carrying, 4.0, touching=False)
    for limit in (0.05, 0.15):
        pushed = goals(USUAL.carrying._replace(most_compliance=limit, push_back=1.0), 4.0)
        assert math.dist(pushed[0, :2], free[0, :2]) == pytest.approx(limit, abs=0.2 * limit)


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_every_tier_carries_at_the_persons_height(small_catalogue, fidelity):
    person = PersonParameters(carrying=USUAL.carrying._replace(least_height=1.2))
    world = world_of(in_reach(small_catalogue, person), fidelity)
    model = world.scene.model
    world.step(Pick("o0"))
    for _ in range(200):
        world.step(Move(turn=0.5))
    body = world.data.body(model.body_rootid[world.scene.index.bodies[0]])
    low = min(
        world.data.geom_xpos[g][2] - model.geom_rbound[g]
        for g in range(model.ngeom)
        if model.geom_bodyid[g] == body.id
    )
    assert low > 1.0


@pytest.mark.parametrize("name", RANGES)
def test_the_printed_limits_are_within_the_range(name):
    for limit in RANGES[name][:2]:
        assert getattr(PersonParameters(**{name: float(f"{limit:.4g}")}), name) == pytest.approx(
            limit, rel=1e-3
        )


@pytest.mark.parametrize("name", RANGES)
def test_the_limits_are_possible_as_they_are_printed(name):
    for limit in RANGES[name][:2]:
        PersonParameters(**{name: float(f"{limit:.4g}")})
