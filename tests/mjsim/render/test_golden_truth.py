"""What frames say is true: markers lie on the planner's path, ids are the model's, and every process draws the same."""

import math
import os
import subprocess
import sys
from pathlib import Path

import cv2
import mujoco
import numpy as np
import pytest
from shapely import LineString, Point
from small_worlds import scene_of

from hud.markers import BREADCRUMB_RADIUS, CHEST, breadcrumbs
from mjsim.house.scene.scene import compose
from mjsim.render import CameraPose, Labels, Renderer
from mjsim.values.episode import Episode

EPISODE = Path(__file__).parents[2] / "golden" / "episode.json"


@pytest.fixture(scope="module")
def scene(house):
    return compose(Episode.load(EPISODE), house.catalogue)


@pytest.fixture(scope="module")
def data(scene):
    made = mujoco.MjData(scene.model)
    mujoco.mj_forward(scene.model, made)
    return made


@pytest.fixture(scope="module")
def renderer(scene):
    with Renderer(scene.model) as made:
        yield made


def back_projected(pose, depth, rows, columns):
    """Points in the house (k, 3) of pixels, from the pinhole model alone."""
    height, width = depth.shape
    top = math.tan(pose.fovy / 2)
    y = top * (1 - 2 * (rows + 0.5) / height)
    x = top * (2 * (columns + 0.5) - width) / height
    local = np.stack([x, y, -np.ones_like(x)], axis=1) * depth[rows, columns][:, None]
    return pose.position + local @ pose.rotation.T


@pytest.mark.parametrize(
    ("start", "goal"), [((8.2, 5.2), (2.0, 5.0)), ((7.0, 9.0), (11.6, 5.6)), ((2.6, 9.2), (4.0, 6.9))]
)
def test_breadcrumb_pixels_lie_on_the_planners_path(house, data, renderer, start, goal):
    """Back through depth: the nearest pixel of each sphere and its radius give the centre, which is on the path."""
    path = house.geodesics.shortest_path(start, goal).points
    line = LineString(path)
    first = line.interpolate(min(2.0, line.length)).coords[0]
    eye = np.array([*start, 2.4])  # so high that the spheres stand apart
    pose = CameraPose.looking_at(eye, (*first, 0.7), 1.0)
    crumbs = breadcrumbs(path, 1.6)
    bare, marked = (renderer.depth(data, pose, m) for m in ((), crumbs))
    mask = marked < bare - 1e-3
    edges = (
        np.abs(np.diff(np.where(mask, marked, 0.0), axis=0, prepend=0)) > 0.06
    )  # one sphere before another
    count, blobs = cv2.connectedComponents((mask & ~edges).astype(np.uint8), connectivity=4)
    found = 0
    for blob in range(1, count):
        rows, columns = np.nonzero(blobs == blob)
        surface = back_projected(pose, marked, rows, columns)
        ranges = np.linalg.norm(surface - eye, axis=1)
        near = int(np.argmin(ranges))
        height, width = np.ptp(rows) + 1, np.ptp(columns) + 1
        whole = 0.85 < height / width < 1.18 and min(height, width) >= 7
        if not whole or np.ptp(ranges) > BREADCRUMB_RADIUS:
            continue  # partly hidden, or two behind each other
        found += 1
        centre = surface[near] + (surface[near] - eye) / ranges[near] * BREADCRUMB_RADIUS
        assert line.distance(Point(centre[:2])) < 0.01
        along = line.project(Point(centre[:2])) / line.length
        expected = 1.6 * CHEST + (BREADCRUMB_RADIUS - 1.6 * CHEST) * along
        assert centre[2] == pytest.approx(expected, abs=0.012)
    assert found >= 3


def one_number_for_drawn_shadows(model, ids):
    """Drawn shadows overlap at one height, where it is chance which of them is seen."""
    names = [model.mat(i).name for i in range(model.nmat)]
    shadows = np.flatnonzero(
        np.isin(model.geom_matid, [i for i, n in enumerate(names) if n.startswith("shadow_")])
    )
    return np.where(np.isin(ids, shadows), shadows[0], ids)


def inner(ids):
    """Pixels whose eight neighbours show what they show."""
    square, numbers = np.ones((3, 3), np.uint8), ids.astype(np.float32)
    return np.asarray(cv2.erode(numbers, square) == cv2.dilate(numbers, square))


def rolled(pose, angle):
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return CameraPose(pose.position, pose.rotation @ turn, pose.fovy)


@pytest.mark.parametrize("place", [(2.6, 8.2), (9.0, 8.2), (2.0, 5.15), (11.4, 1.0)])
def test_segmentation_and_depth_of_the_apartment_are_what_rays_hit(scene, data, place):
    """MuJoCo's ray casting shares nothing with the rasteriser; they differ at silhouettes, by a pixel, alone."""
    model, (width, height) = scene.model, (161, 119)  # odd sides expose row padding
    turn = np.random.default_rng(int(10 * sum(place))).uniform(0, math.tau)
    eye = np.array([*place, 1.6])
    ahead = CameraPose.looking_at(eye, eye + np.array([math.cos(turn), math.sin(turn), -0.4]), 1.2)
    pose = rolled(ahead, 0.3)
    with Renderer(model, width=width, height=height) as small:
        frame = small.frame(data, pose, rgb=False, depth=True, segmentation=True)
    rows, columns = (a.ravel() for a in np.indices((height, width)))
    # Rays as long as a depth of 1 m, so that distances along them are depths.
    rays = back_projected(pose, np.ones((height, width), np.float32), rows, columns) - eye
    hits, depths = np.zeros(len(rays), np.int32), np.zeros(len(rays))
    shown = np.array([1, 1, 1, 0, 0, 0], np.uint8)
    mujoco.mj_multiRay(model, data, eye, rays.ravel(), shown, 1, -1, hits, depths, None, len(rays), np.inf)
    seen, hit = (
        one_number_for_drawn_shadows(model, ids) for ids in (frame.segmentation, hits.reshape(height, width))
    )
    same = seen == hit
    assert same.mean() > 0.98
    sure = inner(seen) & inner(hit)
    assert sure.mean() > 0.6
    assert same[sure].all()
    check = sure & (hit >= 0)
    np.testing.assert_allclose(frame.depth[check], depths.reshape(height, width)[check], rtol=0.01, atol=0.01)


@pytest.mark.parametrize("place", ["apartment", "house whose geoms have no names"])
def test_labels_name_who_a_geom_belongs_to(scene, small_catalogue, place):
    if place != "apartment":
        placed = ("ball", 1.0, 1.0), ("cube", 4.0, 1.0)
        scene = scene_of(small_catalogue, (1.5, 2.0, 0.0), *placed, height=0.1)
    labels = Labels.of(scene)
    keys, names = tuple(scene.receptacles), scene.index.names
    assert labels.instances == ("house", "person", *keys, *names)
    model = scene.model
    body_names = [model.body(int(model.body_rootid[b])).name for b in model.geom_bodyid]
    for geom, (root, number) in enumerate(zip(body_names, labels.instance_of_geom[:-1], strict=True)):
        owner = root.rpartition("/")[0]
        if owner in names or owner == "avatar":
            assert labels.instances[number] == ("person" if owner == "avatar" else owner), geom
    for number, key in enumerate(keys, start=2):
        alone = mujoco.MjModel.from_xml_path(str(scene.catalogue.receptacles[key].path))
        assert (labels.instance_of_geom == number).sum() == alone.ngeom
        center, reach = scene.receptacles[key].center, 2.0 * np.linalg.norm(scene.receptacles[key].half_size)
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        geoms = np.flatnonzero(labels.instance_of_geom[:-1] == number)
        assert np.linalg.norm(data.geom_xpos[geoms] - center, axis=1).max() < reach
    for placed in scene.episode.objects:
        instance = labels.instances.index(placed.name)
        assert labels.categories[labels.category_of_instance[instance]] == placed.category


def test_maps_and_counts_agree_with_the_geom_ids(scene, data, renderer):
    labels = Labels.of(scene)
    ids = renderer.segmentation(data, "avatar/eye")
    ids = np.where(np.arange(640) < 3, -1, ids)  # some background
    instances, categories = labels.instance_map(ids), labels.category_map(ids)
    assert ((instances == -1) == (ids == -1)).all() and ((categories == -1) == (ids == -1)).all()
    counts = labels.pixel_counts(ids)
    assert sum(counts.values()) == (ids >= 0).sum()
    seen = [n for n in scene.index.names if np.isin(ids, scene.index.geoms(n)).any()]
    assert seen and [n for n in counts if n in scene.index.names] == seen
    for name in seen:
        mask = np.isin(ids, scene.index.geoms(name))
        assert counts[name] == mask.sum()
        assert (instances == labels.instances.index(name)).sum() == mask.sum()
        kind = next(o.category for o in scene.episode.objects if o.name == name)
        assert (categories[mask] == labels.categories.index(kind)).all()


DRAW = """
import dataclasses, hashlib, sys
from experiments.session.task_board import TaskBoard
from experiments.house import House
from hud.compose import Compositor
from hud.conditions import condition
from mjsim.values.episode import Episode
from mjsim.render import Renderer, render_pictures
from mjsim.house.scene.scene import compose
from mjsim.world.world import World
from hud.task import KnownPlan, TaskStep
import pathlib
house = House.load("apartment")
scene = compose(Episode.load(pathlib.Path(sys.argv[1])), house.catalogue)
world = World(scene)
seen = world.reset()
names = list(seen.object_names)
path = house.geodesics.shortest_path(seen.position, seen.object_positions[9, :2]).points
ahead = KnownPlan((TaskStep("pick", names[9]),), path=path, goal=tuple(seen.object_positions[9]))
view = TaskBoard(house, scene.episode, names).view(seen, ahead=ahead)
compositor = Compositor(render_pictures(house.catalogue, 48), house.texts)
for name, profile in (("none", "draft"), ("highlight-xray", "fast"), ("optimal", "quality")):
    state = condition(name)(view)
    with Renderer(scene.model, width=320, height=240, profile=profile) as renderer:
        for _ in range(2):
            frame = renderer.frame(world.data, markers=state.markers, depth=True, segmentation=True)
            drawn = compositor.compose(frame.rgb, state)
            parts = drawn.tobytes() + frame.depth.tobytes() + frame.segmentation.tobytes()
            print(hashlib.sha256(parts).hexdigest())
"""


@pytest.mark.slow
def test_frames_of_every_profile_are_identical_over_calls_processes_and_worker_counts():

    def start(threads):
        environment = {k: v for k, v in os.environ.items() if k != "LP_NUM_THREADS"}
        environment |= {} if threads is None else {"LP_NUM_THREADS": threads}
        command = [sys.executable, "-c", DRAW, str(EPISODE)]
        return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)

    alone = start(None).communicate(timeout=120)[0].split()
    assert len(alone) == 6 and alone[::2] == alone[1::2] and len(set(alone)) == 3
    together = [start(threads) for threads in ("1", "3")]
    for process in together:
        assert process.communicate(timeout=240)[0].split() == alone
