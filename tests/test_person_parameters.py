"""What differs from person to person stands once: every tier, the planner, the percept and the picture follow it."""

import dataclasses
import math
from collections.abc import Callable

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.errors import ConfigError
from experiments.house import WALL_GAP, House
from experiments.session.path_following import Pace
from mjsim.actions import Move, Pick
from mjsim.episode import Episode, PlacedObject, StartPose
from mjsim.errors import PersonError
from mjsim.model import avatar
from mjsim.model.catalogue import Catalogue
from mjsim.model.scene import Scene, compose
from mjsim.motion_parameters import MotionParameters
from mjsim.options import FIDELITIES, WorldOptions
from mjsim.person_parameters import RANGES, PersonParameters
from mjsim.render.cameras import camera_pose
from mjsim.visibility import FieldOfView, visible_objects
from mjsim.world import World

USUAL = PersonParameters()
AHEAD = 0.8  # m from the person to the cube, straight ahead
CUBE = 0.1  # m, its size


@pytest.fixture(scope="module")
def before_a_cube(small_catalogue: Catalogue) -> Episode:
    """Somebody in the middle of a room, who looks at a cube."""
    place = (1.5 + AHEAD, 2.0)
    cube = PlacedObject("o0", "solids", "cube", place, (*place, 0.0), (1.0, 0.0, 0.0, 0.0))
    targets = {"o0": small_catalogue.categories["solids"].receptacle}
    start, keys = StartPose(1.5, 2.0, 0.0), tuple(small_catalogue.receptacles)
    return Episode(small_catalogue.name, 0, start, (cube,), keys, targets)


def walked(world: World, *move: float, steps: int) -> np.ndarray:
    """Positions, headings and pitches, (steps + 1, 4), under one move after the other."""
    rows = [world.observation()]
    rows += [world.step(Move(*move)).observation for _ in range(steps)]
    return np.array([(*o.position, o.heading, o.pitch) for o in rows])


def rate(world: World, column: int, *move: float, steps: int) -> float:
    """How fast a column of `walked` changes at the end, per second."""
    rows = walked(world, *move, steps=steps)[:, column]
    return float(abs(rows[-1] - rows[-3]) / (2 * world.control_timestep))


def time_to(world: World, column: int, share: float, *move: float) -> float:
    """Seconds until a column of `walked` changes at a share of the wanted rate."""
    rows = walked(world, *move, steps=40)[:, column]
    rates = np.diff(rows) / world.control_timestep
    return float(np.argmax(rates > share * rates.max()) * world.control_timestep)


def gap_to_wall(world: World) -> float:
    """Distance of the body's axis from the wall y = 0 after walking at it, m."""
    return float(walked(world, 0.0, -1.0, 0.0, steps=90)[-1, 1])


def reaches(world: World) -> bool:
    result = world.step(Pick("o0")).result
    assert result is not None
    return result.applied


def sees(world: World, turned: float = 0.0) -> bool:
    """Whether the cube is in view for somebody turned by an angle, rad."""
    return visible_objects(world.scene, world.data, world.observation().eye, turned, -0.6) == ("o0",)


# Name -> another value, what is measured in a world, and what that must be for a person.
Measure = tuple[float, Callable[[World], float], Callable[[PersonParameters], float]]
MOVES: dict[str, Measure] = {
    "walking_speed": (
        0.8,
        lambda w: rate(w, 1, 0.0, 9.0, 0.0, steps=30),
        lambda p: p.walking_speed * 14 / 13,
    ),
    "walking_acceleration": (
        1.0,
        lambda w: time_to(w, 1, 0.5, 0.0, 1.0),
        lambda p: 0.5 / p.walking_acceleration,
    ),
    "turning_speed": (1.2, lambda w: rate(w, 2, 0.0, 0.0, 9.0, steps=30), lambda p: p.turning_speed),
    "turning_acceleration": (
        4.0,
        lambda w: time_to(w, 2, 0.5, 0.0, 0.0, 2.0),
        lambda p: 1.0 / p.turning_acceleration,
    ),
    "looking_speed": (0.5, lambda w: rate(w, 3, 0.0, 0.0, 0.0, 9.0, steps=12), lambda p: p.looking_speed),
    "body_radius": (0.12, gap_to_wall, lambda p: p.body_radius),
    "eye_height": (1.2, lambda w: w.observation().eye[2], lambda p: p.eye_height),
}


def world_of(episode: Episode, catalogue: Catalogue, person: PersonParameters, fidelity: str) -> World:
    return World(compose(episode, catalogue, person=person), WorldOptions(fidelity=fidelity))


@pytest.mark.parametrize("fidelity", FIDELITIES)
@pytest.mark.parametrize("name", MOVES)
def test_every_tier_moves_by_the_persons_numbers(
    before_a_cube: Episode, small_catalogue: Catalogue, name: str, fidelity: str
) -> None:
    other, measure, expected = MOVES[name]
    for value in (getattr(USUAL, name), other):
        person = dataclasses.replace(USUAL, **{name: value})
        found = measure(world_of(before_a_cube, small_catalogue, person, fidelity))
        assert found == pytest.approx(expected(person), rel=0.03, abs=0.06), f"{name} = {value}"


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_every_tier_reaches_and_sees_as_far_as_the_person(
    before_a_cube: Episode, small_catalogue: Catalogue, fidelity: str
) -> None:
    def world(**values: float) -> World:
        return world_of(before_a_cube, small_catalogue, PersonParameters(**values), fidelity)

    assert reaches(world(reach=AHEAD + 0.05)) and not reaches(world(reach=AHEAD - 0.05))
    assert sees(world(), 0.5) and not sees(world(field_of_view=0.5), 0.5)
    assert sees(world()) and not sees(world(viewing_distance=1.0))


def test_nothing_of_a_person_is_left_out() -> None:
    """The values that no test above measures are those of participants (tests/test_people.py)."""
    elsewhere = {"reach", "field_of_view", "viewing_distance", "looking_interval", "reading_time", "patience"}
    assert {*MOVES, *elsewhere} == set(RANGES)


def test_participants_walk_at_the_persons_pace() -> None:
    person = PersonParameters(
        walking_speed=0.9, walking_acceleration=2.0, turning_speed=1.5, body_radius=0.1, patience=1.0
    )
    assert Pace.of(person)[:5] == pytest.approx((0.9, 1.0, 1.5, 0.3, 1.0))


@pytest.fixture(scope="module")
def house() -> House:
    return House.load()


def test_planned_paths_keep_clear_of_walls_by_the_persons_size(house: House) -> None:
    slim = house.for_person(PersonParameters(body_radius=0.12, reach=0.8))
    assert slim.navmesh.agent_radius == pytest.approx(0.12 + WALL_GAP)
    assert slim.body_geodesics.navmesh.agent_radius == 0.12
    assert slim.geodesics.max_snap == 0.8
    assert slim.navmesh.area > house.navmesh.area
    assert slim.sample_episode(objects=6, seed=1) == house.sample_episode(objects=6, seed=1)
    assert house.for_person(PersonParameters(walking_speed=0.5)) is house


def test_who_cannot_reach_a_bin_is_told_before_the_trial(house: House) -> None:
    office = house.receptacles["office_box"]
    farther = dataclasses.replace(office, center=office.center + 0.3 * office.rotation[:, 1])
    wide = dataclasses.replace(house, receptacles={**house.receptacles, "office_box": farther})
    with pytest.raises(
        ConfigError, match=r"a reach of 0\.60 m is too short for 'office_box', which needs 0\.8\d m"
    ):
        wide.for_person(PersonParameters(reach=0.6))


@given(st.floats(0.5, 2.4), st.sampled_from([(640, 480), (960, 720), (1920, 1080), (480, 640)]))
def test_pictures_of_any_shape_are_as_wide_as_the_percept(field: float, size: tuple[int, int]) -> None:
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


def test_the_usual_picture_is_70_degrees_high(scene: Scene) -> None:
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
        ),  # type: ignore[arg-type]
    ],
)
def test_impossible_people_are_named(values: dict[str, float], message: str) -> None:
    with pytest.raises(PersonError, match=message):
        PersonParameters(**values)  # type: ignore[arg-type]


def test_whole_numbers_do_not_compile_kernels_anew() -> None:
    person = PersonParameters(walking_speed=1, motion=MotionParameters(hover_time=1))
    assert [type(v) for v in (person.walking_speed, person.motion.hover_time)] == [float, float]
    assert type(person.motion.withdraw_steps) is int


def test_a_person_comes_back_from_its_values() -> None:
    person = PersonParameters(reach=0.7, motion=MotionParameters(withdraw_steps=2))
    assert PersonParameters.from_dict(person.as_dict()) == person
    with pytest.raises(PersonError, match="a person has the values"):
        PersonParameters.from_dict({**person.as_dict(), "age": 30})
    with pytest.raises(PersonError, match="motion has the values"):
        PersonParameters.from_dict({**person.as_dict(), "motion": {}})
