"""The apartment as data: what the conventions of docs/models.md promise about it.

That its rooms are closed, reached and seen is asked of `check_house` by test_house_rules.py.
"""

import itertools
from collections import Counter
from pathlib import Path

import cv2
import mujoco
import numpy as np
import pytest

from mjsim.house.compiled.footprint import footprint
from mjsim.values.errors import AssetError
from planner.navmesh import NavMesh
from tools.authoring import __main__ as authoring
from tools.authoring import textures
from tools.authoring.patterns import noise

MODELS = Path(__file__).parents[3] / "models"
HOUSE = str(MODELS / "houses" / "apartment" / "house.xml")
ROOMS = {"kitchen", "living_room", "hall", "bedroom", "bathroom", "second_bedroom", "office"}
CELL = 0.02  # metres
SHAPE = (int(10.4 / CELL), int(12.8 / CELL))


@pytest.fixture(scope="module")
def model():
    return mujoco.MjModel.from_xml_path(HOUSE)


@pytest.fixture(scope="module")
def data(model):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


def body_name(model, geom):
    return str(model.body(model.geom_bodyid[geom]).name)


def colliding(model):
    return [int(geom) for geom in np.flatnonzero(model.geom_contype | model.geom_conaffinity)]


def test_only_structure_and_guards_collide(model):
    """A decoration that collided, or a sofa that did not, would be a typing mistake in a geom's class."""
    collides = (model.geom_contype | model.geom_conaffinity) != 0
    assert set(model.geom_group[collides]) <= {0, 3}
    assert set(model.geom_group[~collides]) <= {1, 2}


def test_forty_pieces_of_furniture_of_several_parts(model):
    parts = Counter(body_name(model, geom) for geom in range(model.ngeom))
    furniture = [
        name
        for name, count in parts.items()
        if name.split("/")[0] in ROOMS and not name.endswith("/structure") and count >= 3
    ]
    assert len(furniture) >= 40
    assert {name.split("/")[0] for name in furniture} == ROOMS


@pytest.mark.slow
@pytest.mark.parametrize(
    ("only", "radius", "area"), [("", 0.25, 3.0), ("", 0.34, 0.0), ("/structure", 0.42, 0.0)]
)
def test_every_room_is_on_the_floor_of_one_person(house, only, radius, area):
    """With room to walk; passages of 0.70 m everywhere between rooms, and of 0.85 m between the walls alone."""
    spec = mujoco.MjSpec.from_file(HOUSE)
    for body in spec.worldbody.bodies:
        if only not in body.name:
            spec.delete(body)
    plan = footprint(spec.compile())
    mesh = NavMesh.build(plan.obstacles, plan.bounds, agent_radius=radius)
    walkable = mesh.cell_centres[mesh.topdown_map == 0]
    cells = Counter(house.rooms.room_at(point) for point in walkable)
    assert all(cells[room] * mesh.resolution**2 > area for room in ROOMS), cells


def test_a_person_can_stand_right_in_front_of_every_receptacle(house):
    for key, receptacle in house.receptacles.items():
        assert house.approaches[key] == pytest.approx(receptacle.approach, abs=0.05), key


@pytest.mark.parametrize("key", ["dish_bin", "office_box"])
def test_counters_carry_their_mounts(model, data, key):
    position = data.site(f"mount:{key}").xpos
    geom = np.array([-1], np.int32)
    groups = np.array([1, 0, 0, 0, 0, 0], np.uint8)
    start = position + np.array([0, 0, 0.05])
    distance = mujoco.mj_ray(model, data, start, np.array([0, 0, -1.0]), groups, 1, -1, geom)
    assert distance == pytest.approx(0.05, abs=1e-3)


def test_nothing_can_be_kicked_under_low_furniture(model, data):
    """Furniture stands on the floor (gap below 2 cm) or lets an object of 0.3 m through (gap above 0.4 m)."""
    lowest = np.full(SHAPE, np.inf)
    signs = np.array(list(itertools.product((-1, 1), repeat=3)))
    for geom in np.flatnonzero(model.geom_contype | model.geom_conaffinity):
        local = model.geom_aabb[geom, :3] + signs * model.geom_aabb[geom, 3:]
        points = data.geom_xpos[geom] + local @ data.geom_xmat[geom].reshape(3, 3).T
        if points[:, 2].max() >= 0.01:
            image = np.zeros(SHAPE, np.uint8)
            pixels = np.round(points[:, :2] / CELL * 16).astype(np.int32)
            cv2.fillConvexPoly(image, cv2.convexHull(pixels), 1, shift=4)
            lowest[image == 1] = np.minimum(lowest[image == 1], points[:, 2].min())
    gap = ((lowest > 0.02) & (lowest < 0.40)).astype(np.uint8)
    # Overhangs narrower than 8 cm hide nothing.
    places = np.argwhere(cv2.erode(gap, np.ones((4, 4), np.uint8)))[:, ::-1] * CELL
    assert not len(places), f"something low overhangs near {np.unique(places.round(1), axis=0).tolist()}"


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(textures.TEXTURES))
def test_textures_are_what_the_scripts_paint(name):
    """One grey level of slack: another processor may round the last bit of a noise field differently."""
    stored = cv2.imread(str(MODELS / "textures" / f"{name}.png"), cv2.IMREAD_UNCHANGED)
    assert stored is not None, "run python -m tools.authoring"
    painted = textures.paint(name)
    if painted.ndim == 3:
        painted = painted[..., [2, 1, 0, *range(3, painted.shape[2])]]
    assert stored.shape == painted.shape
    assert np.abs(stored.astype(int) - painted).max() <= 1
    np.testing.assert_array_equal(textures.paint(name), textures.paint(name))


@pytest.mark.slow
def test_building_writes_every_texture_and_no_other(tmp_path):
    paths = textures.build_textures(tmp_path)
    assert {path.stem for path in paths} == set(textures.TEXTURES)
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in paths}
    assert sum(path.stat().st_size for path in paths) < 4_000_000


def test_authoring_refuses_a_missing_folder(tmp_path, capsys):
    with pytest.raises(SystemExit):
        authoring.main([str(tmp_path / "nowhere")])
    assert "nowhere" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_unknown_texture_is_named_in_the_error():
    with pytest.raises(AssetError, match="'velvet'"):
        textures.paint("velvet")


def test_noise_repeats_without_a_seam():
    """The step across the border is no larger than steps inside the image."""
    field = noise(np.random.default_rng(3), (64, 64), roll_off=1.5)
    inside = np.abs(np.diff(field, axis=1)).mean()
    across = np.abs(field[:, 0] - field[:, -1]).mean()
    assert across < 2.0 * inside
