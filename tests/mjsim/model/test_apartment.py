"""The apartment as data: what the conventions of docs/models.md promise about it, measured independently of mjsim.

Free space is rasterised here from every geom's bounding box, which only overestimates what is occupied.
"""

import re
from collections import Counter
from pathlib import Path

import cv2
import mujoco
import numpy as np
import pytest

from mjsim.errors import AssetError
from tools.authoring import __main__ as authoring
from tools.authoring import textures
from tools.authoring.patterns import noise

MODELS = Path(__file__).parents[3] / "models"
ROOMS = {"kitchen", "living_room", "hall", "bedroom", "bathroom", "second_bedroom", "office"}
MOUNTS = {"dish_bin", "toy_box", "bookshelf", "laundry_hamper", "office_box", "recycling_bin"}
CELL = 0.02  # metres
MARGIN = 1.0  # metres around the shell, to see whether one could get out
ORIGIN = np.array([-MARGIN, -MARGIN])
SHAPE = (int((10.4 + 2 * MARGIN) / CELL), int((12.8 + 2 * MARGIN) / CELL))


@pytest.fixture(scope="module")
def model():
    return mujoco.MjModel.from_xml_path(str(MODELS / "houses" / "apartment" / "house.xml"))


@pytest.fixture(scope="module")
def data(model):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


def body_name(model, geom):
    return str(model.body(model.geom_bodyid[geom]).name)


def colliding(model):
    return [int(geom) for geom in np.flatnonzero(model.geom_contype | model.geom_conaffinity)]


def corners(model, data, geom):
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    local = model.geom_aabb[geom, :3] + signs * model.geom_aabb[geom, 3:]
    return np.asarray(data.geom_xpos[geom] + local @ data.geom_xmat[geom].reshape(3, 3).T)


def fill(image, points):
    pixels = np.round((points[:, :2] - ORIGIN) / CELL * 16).astype(np.int32)
    cv2.fillConvexPoly(image, cv2.convexHull(pixels), 1, shift=4)


def occupied(model, data, only=""):
    image = np.zeros(SHAPE, np.uint8)
    for geom in colliding(model):
        points = corners(model, data, geom)
        if points[:, 2].max() > 0.05 and points[:, 2].min() < 1.8 and only in body_name(model, geom):
            fill(image, points)
    return image


def islands(blocked, radius):
    """Label the places where a disc of `radius` fits; 0 is blocked."""
    steps = round(radius / CELL)
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * steps + 1, 2 * steps + 1))
    _, labels = cv2.connectedComponents(1 - cv2.dilate(blocked, disc), connectivity=4)
    return np.asarray(labels, dtype=np.int32)


def room_windows(model):
    windows = []
    for index in range(model.nsite):
        match = re.fullmatch(r"room:(\w+?)(?::\d+)?", model.site(index).name)
        if match:
            centre, half = model.site_pos[index, :2], model.site_size[index, :2]
            low = np.round((centre - half - ORIGIN) / CELL).astype(int)
            high = np.round((centre + half - ORIGIN) / CELL).astype(int)
            windows.append((match[1], (slice(low[1], high[1]), slice(low[0], high[0]))))
    return windows


def main_island(labels, model):
    counts = Counter()
    for _, window in room_windows(model):
        values, sizes = np.unique(labels[window][labels[window] > 0], return_counts=True)
        counts.update(dict(zip(values.tolist(), sizes.tolist(), strict=True)))
    return counts.most_common(1)[0][0]


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


def test_a_person_reaches_every_room(model, data):
    labels = islands(occupied(model, data), 0.25)
    main = main_island(labels, model)
    area = Counter()
    for room, window in room_windows(model):
        area[room] += int((labels[window] == main).sum())
    for room in ROOMS:
        assert area[room] * CELL**2 > 3.0, f"hardly any floor to walk on in {room}"
    # 40 points at least 1 m apart have to fit.
    assert sum(area.values()) * CELL**2 > 55.0


@pytest.mark.parametrize(("only", "radius"), [("", 0.34), ("/structure", 0.42)])
def test_rooms_stay_connected_for_a_wider_person(model, data, only, radius):
    """Passages of 0.70 m everywhere between rooms, and of 0.85 m between the walls alone."""
    labels = islands(occupied(model, data, only), radius)
    main = main_island(labels, model)
    assert {room for room, window in room_windows(model) if (labels[window] == main).any()} == ROOMS


def test_nobody_gets_out(model, data):
    labels = islands(occupied(model, data, only="/structure"), 0.0)
    assert labels[0, 0] != main_island(labels, model)


@pytest.mark.parametrize("key", sorted(MOUNTS))
def test_a_person_can_stand_before_every_mount(model, data, key):
    """Within reach (0.75 m), in front of it (local -y within 30 degrees); the receptacle itself takes 0.25 m."""
    labels = islands(occupied(model, data), 0.25)
    free = np.argwhere(labels == main_island(labels, model))[:, ::-1] * CELL + ORIGIN + CELL / 2
    site = data.site(f"mount:{key}")
    offset = free - site.xpos[:2]
    distance = np.linalg.norm(offset, axis=1)
    front = -site.xmat.reshape(3, 3)[:2, 1]
    ahead = offset @ front / np.maximum(distance, 1e-9) > np.cos(np.radians(30))
    assert ((distance < 0.75) & (distance > 0.25) & ahead).any()


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
    for geom in colliding(model):
        points = corners(model, data, geom)
        if points[:, 2].max() < 0.01:
            continue
        image = np.zeros(SHAPE, np.uint8)
        fill(image, points)
        lowest[image == 1] = np.minimum(lowest[image == 1], points[:, 2].min())
    gap = ((lowest > 0.02) & (lowest < 0.40)).astype(np.uint8)
    # Overhangs narrower than 8 cm hide nothing.
    places = np.argwhere(cv2.erode(gap, np.ones((4, 4), np.uint8)))[:, ::-1] * CELL + ORIGIN
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
