"""The floor plan's scale is exact, and neither ceilings nor lintels hide what is below them."""

import copy

import mujoco
import numpy as np
import pytest

from mjsim.generator.home_cache import load_catalogue
from mjsim.generator.recipe import floor_plan_of
from mjsim.house.compiled.house import compiled_house
from mjsim.render import largest_scale, render_floorplan
from mjsim.values.errors import RenderError

# A red tile with its corners at whole centimetres, under a green ceiling; a tall blue post away from the centre.
HOUSE = """<mujoco><worldbody>
  <geom type="box" size="2 1.5 .05" pos="3 2 -.05" rgba="1 1 1 1"/>
  <geom type="box" size=".25 .15 .01" pos="1.75 1.05 .01" rgba="1 0 0 1"/>
  <geom type="box" size=".05 .05 1" pos="4.55 3.15 1" rgba="0 0 1 1"/>
  <geom type="box" size="2 1.5 .05" pos="3 2 2.6" rgba="0 1 0 1" group="1"/>
</worldbody></mujoco>"""
BOUNDS = (1.0, 0.5, 5.0, 3.5)


@pytest.fixture(scope="module")
def house():
    model = mujoco.MjModel.from_xml_string(HOUSE)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def box_of(mask):
    """Columns and rows that a mask covers, ends exclusive."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return columns[0], rows[0], columns[-1] + 1, rows[-1] + 1


def coloured(rgb, channel):
    others = np.delete(rgb.astype(int), channel, axis=2).max(axis=2)
    return rgb[..., channel].astype(int) > others + 60


@pytest.mark.parametrize("scale", [40.0, 100.0])
@pytest.mark.parametrize(
    ("channel", "corners"), [(0, [(1.5, 1.2), (2.0, 0.9)]), (2, [(4.5, 3.2), (4.6, 3.1)])]
)
def test_known_tiles_land_on_their_pixels(house, scale, channel, corners):
    plan = render_floorplan(*house, BOUNDS, scale)
    expected = plan.to_pixels(corners).ravel()
    assert np.abs(np.array(box_of(coloured(plan.rgb, channel))) - expected).max() <= 0.5 + 1e-9


@pytest.mark.parametrize(
    ("asked", "scale", "grown", "size"),
    [(BOUNDS, 60, BOUNDS, (240, 180)), ((1.0, 0.5, 4.99, 3.49), 10, (1.0, 0.49, 5.0, 3.49), (40, 30))],
)
def test_bounds_grow_to_whole_pixels_of_the_scale(house, asked, scale, grown, size):
    plan = render_floorplan(*house, asked, scale)
    assert plan.rgb.shape == (*size[::-1], 3)
    assert plan.bounds == pytest.approx(grown)
    corners = np.array(grown)[[[0, 3], [2, 1]]]
    np.testing.assert_allclose(plan.to_pixels(corners), [[0, 0], size], atol=1e-9)


def test_the_ceiling_is_hidden_and_outside_is_paper(house):
    plan = render_floorplan(*house, (0.0, 0.0, 6.0, 4.0), 20)
    assert not coloured(plan.rgb, 1).any()
    assert (plan.rgb[0, 0] == plan.rgb[-1, -1]).all() and plan.rgb[0, 0].min() > 200


@pytest.mark.parametrize(
    ("bounds", "scale"),
    [((1, 0, 1, 2), 60), ((0, 0, 1, 1), 0), ((0, 0, np.inf, 1), 60), ((0, 0, 100, 1), 100)],
)
def test_unusable_bounds_and_scales_are_refused(house, bounds, scale):
    with pytest.raises(RenderError):
        render_floorplan(*house, bounds, scale)


def test_the_person_is_not_drawn(scene):
    """Who starts out is no part of the house; a walk is drawn as a line."""
    data = mujoco.MjData(scene.model)
    bounds = (0.0, 0.0, 12.8, 10.4)
    plans = []
    for place in ((2.0, 2.0), (8.0, 8.0)):
        data.joint("avatar/x").qpos[0], data.joint("avatar/y").qpos[0] = place
        mujoco.mj_forward(scene.model, data)
        plans.append(render_floorplan(scene.model, data, bounds, 40).rgb)
    assert np.array_equal(*plans)


@pytest.mark.parametrize("size", [(12_000.0, 9_000.0), (12_000.0, 5.0), (0.1, 0.2)])
def test_a_house_of_any_size_can_be_drawn_at_some_scale(house, size):
    bounds = (-1.0, -2.0, size[0] - 1.0, size[1] - 2.0)
    assert largest_scale(bounds) == pytest.approx(4095 / max(size))
    plan = render_floorplan(*house, bounds, min(60.0, 300 / max(size)))
    assert 12 <= max(plan.rgb.shape) <= 301


def test_objects_of_the_apartment_lie_where_the_plan_says(scene):
    """Loose objects painted magenta must show at their computed pixels, up to their own size."""
    model = copy.deepcopy(scene.model)
    loose = scene.index.geom_owner >= 0
    model.geom_matid[loose] = -1
    model.geom_rgba[loose] = 1, 0, 1, 1
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    plan = render_floorplan(model, data, (-0.3, -0.3, 13.1, 10.7), 40)
    rgb = plan.rgb.astype(int)
    magenta = np.argwhere(rgb[..., [0, 2]].min(axis=2) > rgb[..., 1] + 80)[:, ::-1] + 0.5
    places = plan.to_pixels(data.xpos[scene.index.bodies][:, :2])
    apart = np.linalg.norm(places[:, None] - magenta[None], axis=2)
    assert apart.min(axis=1).max() < 0.1 * 40
    assert apart.min(axis=0).max() < 0.35 * 40  # and magenta is nowhere else


WALL = """<mujoco><worldbody>
  <geom type="box" size="2 1 .05" pos="2 1 -.05" rgba="1 1 1 1"/>
  <geom type="box" size=".75 .05 1.2" pos=".75 1 1.2" rgba="0 0 1 1"/>
  <geom type="box" size=".75 .05 1.2" pos="3.25 1 1.2" rgba="0 0 1 1"/>
  <geom type="box" size=".5 .05 .2" pos="2 1 2.2" rgba="0 0 1 1"/>
  <geom type="box" size=".02 .5 1" pos="1.53 .55 1" rgba="0 1 0 1"/>
  <geom type="box" size=".5 .05 .4" pos="2 1 {height}" rgba="1 0 0 1"/>
</worldbody></mujoco>"""


@pytest.mark.parametrize(("height", "open_passage"), [(-9.0, True), (0.4, False)])
def test_a_lintel_is_left_out_over_a_passage_but_not_over_a_parapet(height, open_passage):
    """A door that stands open in the passage does not close it, and what is below a lintel is drawn."""
    model = mujoco.MjModel.from_xml_string(WALL.format(height=height))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    plan = render_floorplan(model, data, (0.0, 0.0, 4.0, 2.0), 50)
    (left, top), (right, bottom) = plan.to_pixels([(1.6, 1.04), (2.45, 0.96)]).round().astype(int)
    assert coloured(plan.rgb, 2)[top:bottom, left:right].any() != open_passage
    assert coloured(plan.rgb, 2)[top:bottom, : plan.to_pixels([(1.45, 1.0)]).astype(int)[0, 0]].all()


def doorways(name, model):
    """Yield the middle of each inner doorway of a house, in metres."""
    if name == "apartment":
        frames = [model.geom(i) for i in range(model.ngeom) if "/doorway_" in model.geom(i).name]
        yield from (frame.pos[:2] for frame in frames if frame.name.endswith("_top"))
        return
    plan = floor_plan_of(load_catalogue(name).house_path)
    for door in plan.doors:
        if not door.is_front:
            room = plan.room(door.rooms[0])
            wall = room.floor.along(door.side_in(room.key), door.center - 0.1, door.center + 0.1, -0.06, 0.0)
            yield np.array(wall.center)


@pytest.mark.parametrize("name", ["apartment", "generated:3?rooms=4"])
def test_doorways_show_the_floor_on_which_one_walks(name):
    house = compiled_house(load_catalogue(name))
    bounds, scale = house.rooms.bounds, 50.0
    floors = copy.copy(house.model)
    floors.geom_group[house.data.geom_xpos[:, 2] > 0.05] = 3
    plans = [render_floorplan(model, house.data, bounds, scale) for model in (house.model, floors)]
    middles = np.array(list(doorways(name, house.model)))
    assert len(middles) >= 3
    for column, row in plans[0].to_pixels(middles).astype(int):
        drawn, floor = (plan.rgb[row - 2 : row + 3, column - 2 : column + 3].astype(int) for plan in plans)
        assert np.abs(drawn - floor).max() < 40, "but for a shadow, the floor"
