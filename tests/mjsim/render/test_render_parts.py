"""What is left out of a frame leaves no trace; contact shadows; several cameras; a driver that hangs."""

import dataclasses
import math
import os
import subprocess
import sys

import cv2
import mujoco
import numpy as np
import pytest

from mjsim.render import FAST, CameraPose, Renderer, RenderProfile
from mjsim.render.cameras import Bounds, ViewVolume, outside
from mjsim.render.occlusion import BoxOccluders
from mjsim.render.rasteriser import Rasteriser, reduced

# Seen from the origin along +x: a wall of 2 x 2 m at x = 2 and small objects behind it.
WALL = """<mujoco>
  <asset><material name="glass" rgba="1 1 1 .3"/></asset>
  <worldbody>
    <geom name="wall" type="box" pos="2 0 0" size=".05 1 1" {wall}/>
    <geom name="behind" pos="4 0 0" size=".2"/>
    <geom name="at_the_edge" pos="4 {edge} 0" size=".2"/>
    <geom name="before" pos="1.5 0 0" size=".2"/>
    <geom name="inside" type="box" pos="2 .2 0" size=".04 .1 .1"/>
    <geom name="ground" type="plane" pos="4 0 -.2" size="0 0 1"/>
    <geom name="rug_behind" type="plane" pos="4 0 -.2" size=".3 .2 1"/>
    <geom name="strip" type="plane" pos="2.5 {strip} -.2" size="1.5 .05 1"/>
    <geom name="long" type="box" pos="4 0 0" euler="0 0 90" size="2.5 .05 .05"/>
  </worldbody></mujoco>"""
AHEAD = np.array([[0.0, 0, -1], [-1, 0, 0], [0, 1, 0]])


def hidden(view=None, *, wall="", edge=2.5, strip=1.5):
    model = mujoco.MjModel.from_xml_string(WALL.format(wall=wall, edge=edge, strip=strip))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    everything = np.ones(model.ngeom, bool)
    view = view or ViewVolume(np.zeros(3), AHEAD, 0.7)
    rotations = data.geom_xmat.reshape(-1, 3, 3)
    occluders = BoxOccluders(model, Bounds.of(model), model.geom_group < 3)
    mask = occluders.unseen(view, 1.3, data.geom_xpos, rotations, everything)
    return {model.geom(i).name for i in np.flatnonzero(mask)}


def test_a_wall_hides_what_stands_wholly_behind_it():
    assert hidden() == {"behind", "rug_behind"}


def test_the_edge_of_a_wall_by_hand():
    """The wall's middle reaches y = 1 at x = 2, so its shadow ends at y = x / 2."""
    fits = 2.0 - 0.2 - 0.01 * math.hypot(1, 0.5)  # a box around the sphere, and the margin
    fits -= 0.1  # the box's near corner lies at x = 3.8
    assert "at_the_edge" in hidden(edge=fits - 0.005)
    assert "at_the_edge" not in hidden(edge=fits + 0.005)


def test_what_lies_beside_the_view_is_left_out_though_the_sphere_around_it_reaches_into_it():
    """At x = 4 the view ends at y = 3.64; the strip's far end lies there."""
    assert "strip" not in hidden(strip=3.6)
    assert "strip" in hidden(strip=4.2)
    sphere = outside(ViewVolume(np.zeros(3), AHEAD, 0.7), 1.3, np.array([[2.5, 4.2, 0]]), np.array([1.5]))
    assert not sphere.any()


@pytest.mark.parametrize("wall", ['rgba="1 1 1 .99"', 'material="glass"', 'group="3"'])
def test_what_is_seen_through_hides_nothing(wall):
    assert hidden(wall=wall) == set()


def test_a_wall_at_the_eye_or_in_a_parallel_view_hides_nothing():
    for x in (1.9, 2.0):
        assert not hidden(ViewVolume(np.array([x, 0, 0]), AHEAD, 0.7), edge=1.0) & {"behind", "at_the_edge"}
    assert hidden(ViewVolume(np.zeros(3), AHEAD, 0.7, orthographic=True)) == set()


def assert_same(one, other, images=("rgb", "depth", "segmentation")):
    for image in images:
        np.testing.assert_array_equal(getattr(one, image), getattr(other, image))


@pytest.mark.slow
def test_leaving_out_changes_no_pixel_of_the_apartment(scene, navmesh, monkeypatch):
    data = mujoco.MjData(scene.model)
    mujoco.mj_forward(scene.model, data)
    rng = np.random.default_rng(3)
    with Renderer(scene.model, width=120, height=90) as made:
        poses = []
        for _ in range(24):
            eye, turn = np.array([*navmesh.sample(rng), 1.6]), rng.uniform(0, math.tau)
            gaze = np.array([math.cos(turn), math.sin(turn), rng.uniform(-0.8, 0.3)])
            poses.append(CameraPose.looking_at(eye, eye + gaze, 1.2))
        kept = made.frames(data, poses, depth=True, segmentation=True)
        left_out = []
        unseen = Rasteriser._unseen
        monkeypatch.setattr(
            Rasteriser,
            "_unseen",
            lambda self, *a: left_out.append(unseen(self, *a).mean()) or np.zeros(scene.model.ngeom, bool),
        )
        whole = made.frames(data, poses, depth=True, segmentation=True)
    assert np.mean(left_out) > 0.6  # or nothing was tested
    for one, other in zip(kept, whole, strict=True):
        assert_same(one, other)


FLOOR = """<mujoco>
  <asset>
    <material name="{material}" rgba="0 0 0 .6"/>
  </asset>
  <visual><headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/></visual>
  <worldbody>
    <geom name="floor" type="box" pos="0 0 -.05" size="3 3 .05" rgba=".9 .9 .9 1"/>
    <body pos="0 0 .1"><freejoint/><geom name="object" type="box" size=".1 .2 .1"/></body>
  </worldbody></mujoco>"""
ABOVE = CameraPose.looking_at((0, 0, 3), (0, 0, 0), 0.6)
PLAIN = RenderProfile("plain", skybox=False)
SPOTS = dataclasses.replace(PLAIN, contact_shadows=True)


def darkening(height, *, material="shadow_round", turn=0.0):
    """How much darker each pixel of a view from straight above gets, 2.3 cm per pixel on the floor."""
    model = mujoco.MjModel.from_xml_string(FLOOR.format(material=material))
    data = mujoco.MjData(model)
    data.qpos[2], data.qpos[3], data.qpos[6] = height + 0.1, math.cos(turn / 2), math.sin(turn / 2)
    mujoco.mj_forward(model, data)
    frames = []
    for profile in (PLAIN, SPOTS):
        with Renderer(model, width=80, height=80, profile=profile) as made:
            frames.append(made.frame(data, ABOVE, depth=True, segmentation=True))
    assert_same(*frames, images=("depth", "segmentation"))
    return frames[0].rgb.astype(int).sum(axis=2) - frames[1].rgb.astype(int).sum(axis=2)


def test_a_spot_lies_around_an_object_on_the_floor_and_nowhere_else():
    dark = darkening(0.0)
    assert dark.min() == 0
    rows, columns = np.nonzero(dark)
    metres = 3.0 * 2 * math.tan(0.3) / 80
    assert np.ptp(columns) * metres == pytest.approx(0.3, abs=0.06)  # the object and 5 cm on either side
    assert np.ptp(rows) * metres == pytest.approx(0.5, abs=0.06)
    turned = darkening(0.0, turn=math.pi / 2)
    assert np.ptp(np.nonzero(turned)[1]) > 1.3 * np.ptp(np.nonzero(turned)[0])


def test_a_spot_fades_as_its_object_is_lifted():
    strongest = [darkening(height).max() for height in (0.0, 0.1, 0.2, 0.31)]
    assert strongest[0] > strongest[1] > strongest[2] > strongest[3] == 0


def test_spots_need_a_profile_and_a_material_that_the_apartment_has(house_model):
    assert not darkening(0.0, material="other").any()
    assert FAST.contact_shadows and house_model.mat("shadow_round")


def flat_things(model, data):
    """Material and top of the rugs and drawn shadows, m: wide, thin, seen but not touched."""
    found = []
    for geom in np.flatnonzero((model.geom_group == 2) & (data.geom_xpos[:, 2] < 0.02)):
        is_plane = model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE
        reach = np.abs(data.geom_xmat[geom].reshape(3, 3)) @ model.geom_aabb[geom, 3:]
        if is_plane or (reach[:2].min() > 0.2 and reach[2] < 0.01):
            name = model.mat(model.geom_matid[geom]).name
            found.append((name, data.geom_xpos[geom, 2] + (0.0 if is_plane else reach[2])))
    return found


def test_nothing_flat_on_the_floor_covers_what_lies_on_it(scene):
    """A plate's bottom is 7 mm up. Rugs, drawn shadows and the spots under objects all stay below it, on every rug."""
    model, data = scene.model, mujoco.MjData(scene.model)
    mujoco.mj_kinematics(model, data)
    flat = flat_things(model, data)
    assert {"rug_living", "rug_runner", "rug_bedroom", "rug_round", "shadow_box"} <= {
        name for name, _ in flat
    }
    assert max(top for _, top in flat) <= 0.005
    plate = next(o.name for o in scene.episode.objects if o.model == "plate")
    address = model.joint(f"{plate}/free").qposadr[0]
    with Renderer(model, width=64, height=48, profile=FAST) as made:
        for room, rug in {"living": (10.0, 8.0), "child's": (7.9, 1.8), "bedroom": (1.9, 1.2)}.items():
            data.qpos[address : address + 3] = *rug, 0.0
            mujoco.mj_forward(model, data)
            at = data.body(f"{plate}/object").xpos
            seen = made.rgb(data, CameraPose.looking_at(at + np.array([0.2, 0.1, 0.6]), at, 0.4))
            assert seen[22:26, 30:34].min() > 120 and np.ptp(seen[22:26, 30:34]) < 60, f"{room}: white china"


def test_many_cameras_see_what_each_sees_alone(scene):
    data = mujoco.MjData(scene.model)
    mujoco.mj_forward(scene.model, data)
    eye = data.camera("avatar/eye").xpos
    cameras = ["avatar/eye", *(CameraPose.looking_at(eye, eye + d, 1.0) for d in np.eye(3)[:2])]
    with Renderer(scene.model, width=64, height=48) as made:
        together = made.frames(data, cameras, depth=True, segmentation=True)
        for camera, frame in zip(cameras, together, strict=True):
            assert_same(frame, made.frame(data, camera, depth=True, segmentation=True))
        assert made.frames(data, []) == ()


@pytest.mark.parametrize("scale", [1.0, 1.25, 1.5, 2.0])
def test_reduction_keeps_places_and_brightness(scale):
    width, height = 64, 48
    side = (round(width * scale), round(height * scale))
    rows, columns = np.mgrid[0 : side[1], 0 : side[0]]
    smooth = np.exp(-(((columns + 0.5) / scale - 40) ** 2 + ((rows + 0.5) / scale - 12) ** 2) / 50)
    drawn = np.repeat((255 * smooth).astype(np.uint8)[..., None], 3, 2)
    small = reduced(drawn, (width, height))
    assert small.shape == (48, 64, 3)
    moments = cv2.moments(small[..., 0])
    assert moments["m10"] / moments["m00"] == pytest.approx(39.5, abs=0.1)
    assert moments["m01"] / moments["m00"] == pytest.approx(47 - 11.5, abs=0.1)  # rows from the top
    assert small.max() == pytest.approx(255, abs=6)


HANG = """
import sys, time, types
module = types.ModuleType("mujoco.egl")
class GLContext:
    def __init__(self, width, height): time.sleep(600)
module.GLContext = GLContext
import mujoco
sys.modules["mujoco.egl"] = module
from mjsim.render.diagnostics import environment_report
from mjsim.values.errors import RenderError
from mjsim.render import gl_info
try:
    gl_info()
except RenderError as error:
    print(error)
report = environment_report()
print(report.usable, report.gl, "did not start" in "\\n".join(report.lines()))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "limit", ["0.3", *(pytest.param(text, marks=pytest.mark.slow) for text in ("nan", "soon", "-1"))]
)
def test_a_hanging_driver_is_an_error_with_a_remedy_and_the_doctor_reports_it(limit):
    done = subprocess.run(
        [sys.executable, "-c", HANG],
        env={**os.environ, "MUJOCO_GL": "egl", "MJSIM_GL_TIMEOUT": limit},
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    error, report = done.stdout.strip().splitlines()
    if limit == "0.3":
        assert "did not start within 0.3 s" in error and "MJSIM_GL_TIMEOUT" in error and "nvidia-smi" in error
    else:
        assert f"MJSIM_GL_TIMEOUT must be a positive number of seconds, got {limit!r}" in error
    assert report == f"False None {limit == '0.3'}"
    assert done.stderr == ""
