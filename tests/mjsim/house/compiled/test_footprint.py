"""The floor plan covers what blocks a person, tightly, and nothing else."""

import math

import mujoco
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mjsim.house.compiled.footprint import footprint
from mjsim.house.compiled.house import compiled_house
from mjsim.values.errors import AssetError

ROOM = '<site name="room:r" type="box" pos="1 2 1" size="3 4 1"/>'
WEDGE = '<asset><mesh name="wedge" vertex="0 0 0 .4 0 0 0 .3 0 0 0 .5"/></asset>'
SHAPES = {
    "sphere": 'type="sphere" size=".3"',
    "capsule": 'type="capsule" size=".2 .4"',
    "ellipsoid": 'type="ellipsoid" size=".5 .2 .1"',
    "cylinder": 'type="cylinder" size=".3 .2"',
    "box": 'type="box" size=".5 .2 .1"',
    "mesh": 'type="mesh" mesh="wedge"',
}


def _compile(body, assets=""):
    return mujoco.MjModel.from_xml_string(f"<mujoco>{assets}<worldbody>{ROOM}{body}</worldbody></mujoco>")


def _surface(kind, size, rng):
    """Many points of a shape in its own frame, written without the support functions under test."""
    ball = rng.normal(size=(4000, 3))
    ball /= np.linalg.norm(ball, axis=1, keepdims=True)
    if kind == "sphere":
        return size[0] * ball
    if kind == "ellipsoid":
        return size * ball
    if kind == "box":
        return size * rng.choice([-1.0, 1.0], size=(4000, 3))
    if kind == "capsule":
        return size[0] * ball + [0, 0, size[1]] * rng.choice([-1.0, 1.0], size=(4000, 1))
    angle = rng.uniform(0, 2 * np.pi, 4000)
    rim = np.column_stack([size[0] * np.cos(angle), size[0] * np.sin(angle)])
    return np.column_stack([rim, size[1] * rng.choice([-1.0, 1.0], 4000)])


def check_convex(polygon):
    """Convex, and counter-clockwise."""
    assert shapely.LinearRing(polygon).is_ccw
    assert math.isclose(shapely.Polygon(polygon).area, shapely.Polygon(polygon).convex_hull.area)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(
    kind=st.sampled_from(["sphere", "capsule", "ellipsoid", "cylinder", "box"]),
    turn=st.tuples(*[st.integers(-9, 9)] * 4).filter(any),
    seed=st.integers(0, 2**32 - 1),
)
def test_outline_covers_the_shape_tightly(kind, turn, seed):
    quat = " ".join(map(str, turn))
    model = _compile(f'<body pos="1 2 .9" quat="{quat}"><geom {SHAPES[kind]}/></body>')
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    points = _surface(kind, model.geom_size[0], np.random.default_rng(seed))
    points = points @ data.geom_xmat[0].reshape(3, 3).T + data.geom_xpos[0]
    exact = shapely.MultiPoint(points[:, :2]).convex_hull
    (polygon,) = footprint(model).obstacles
    check_convex(polygon)
    assert shapely.Polygon(polygon).buffer(1e-9).contains(exact)
    # The circumscribed polygon adds 0.65 % of a disc's area; the rest is what samples leave out of the oracle.
    assert shapely.Polygon(polygon).area <= exact.area * 1.04


def test_meshes_are_exact():
    model = _compile('<body pos="1 2 .3" euler="0 0 90"><geom type="mesh" mesh="wedge"/></body>', WEDGE)
    (polygon,) = footprint(model).obstacles
    check_convex(polygon)
    expected = shapely.Polygon([(1, 2), (1, 2.4), (0.7, 2)])
    assert shapely.Polygon(polygon).symmetric_difference(expected).area < 1e-6


@pytest.mark.parametrize(
    ("body", "blocks"),
    [
        ('<geom type="plane" size="5 5 .1"/>', False),
        ('<geom type="box" size="5 5 .1" pos="0 0 -.1"/>', False),  # a floor
        ('<geom type="box" size="1 1 .01" pos="0 0 .01"/>', False),  # a rug
        ('<geom type="box" size="1 1 .03" pos="0 0 .03"/>', True),  # a step
        ('<geom type="box" size=".05 .5 .2" pos="0 0 2.2"/>', False),  # a lintel
        ('<geom type="box" size=".05 .5 .2" pos="0 0 1.9"/>', True),  # too low a lintel
        ('<geom type="sphere" size=".2" pos="0 0 1" contype="0" conaffinity="0"/>', False),  # a picture
        ('<geom type="sphere" size=".2" pos="0 0 1" contype="0" conaffinity="2"/>', True),
        ('<geom type="sphere" size=".2" pos="0 0 1" group="3"/>', True),  # a guard
        ('<body><freejoint/><geom type="sphere" size=".2" pos="0 0 1"/></body>', False),
        ('<body><joint type="slide"/><body><geom size=".2" pos="0 0 1"/></body></body>', False),
        ('<body><body><geom size=".2" pos="0 0 1"/></body></body>', True),
    ],
)
def test_what_blocks_a_person(body, blocks):
    assert len(footprint(_compile(body)).obstacles) == blocks


def test_band_of_heights_is_a_parameter():
    model = _compile('<geom type="box" size="1 1 .1" pos="0 0 2.2"/>')
    assert len(footprint(model, high=2.2).obstacles) == 1
    assert len(footprint(model, low=2.4, high=3).obstacles) == 0


def test_unknown_outline_is_an_error():
    field = '<asset><hfield name="hills" nrow="2" ncol="2" size="1 1 1 1" elevation="0 1 1 0"/></asset>'
    with pytest.raises(AssetError, match=r"hilly.*HFIELD"):
        footprint(_compile('<geom name="hilly" type="hfield" hfield="hills"/>', field))


def test_small_house_is_walls_and_receptacles(small_catalogue):
    plan = footprint(compiled_house(small_catalogue).model)
    # Neither lintel nor lamp nor the receptacles' thin floors.
    assert len(plan.obstacles) == 6 + 2 * 4
    assert plan.bounds == (0, 0, 6, 4)


def test_objects_and_person_are_not_obstacles(scene, catalogue):
    inhabited, empty = footprint(scene.model), footprint(compiled_house(catalogue).spec().compile())
    assert inhabited.bounds == empty.bounds
    for a, b in zip(inhabited.obstacles, empty.obstacles, strict=True):
        np.testing.assert_array_equal(a, b)


def test_what_a_ray_meets_is_covered(house_model, house_footprint):
    data = mujoco.MjData(house_model)
    mujoco.mj_forward(house_model, data)
    covered = shapely.union_all([shapely.Polygon(p) for p in house_footprint.obstacles]).buffer(1e-9)
    xmin, ymin, xmax, ymax = house_footprint.bounds
    solid = np.array([1, 0, 0, 1, 0, 0], np.uint8)
    met = 0
    for x, y in np.random.default_rng(0).uniform((xmin, ymin), (xmax, ymax), (4000, 2)):
        geom = np.full(1, -1, np.int32)
        distance = mujoco.mj_ray(house_model, data, [x, y, 1.79], [0, 0, -1], solid, True, -1, geom)
        if 0 <= distance < 1.79 - 0.051:
            met += 1
            assert shapely.contains_xy(covered, x, y), (x, y, house_model.geom(geom[0]).name)
    assert met > 100
