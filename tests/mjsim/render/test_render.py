"""Frames agree with geometry that can be worked out by hand, and are the same every time."""

import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import cv2
import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjsim.render import PROFILES, CameraPose, Renderer, RenderProfile, context
from mjsim.render.cameras import ViewVolume, outside
from mjsim.render.markers import LINES
from mjsim.values.errors import RenderError

# A room seen along +x: back wall at x = 4, a low partition at x = 2 on the right (y < 0), a tilted camera as well.
ROOM = """<mujoco>
  <statistic extent="4" center="2 0 1"/>
  <visual><headlight ambient=".4 .4 .4" diffuse=".3 .3 .3"/></visual>
  <asset><texture name="chequer" type="2d" builtin="checker" rgb1=".2 .2 .2" rgb2=".8 .8 .8" width="64" height="64"/>
    <material name="chequer" texture="chequer" texrepeat="8 8"/></asset>
  <worldbody>
    <light type="directional" dir="0.3 0.2 -1" diffuse=".4 .4 .4" castshadow="true" pos="2 0 5"/>
    <camera name="ahead" pos="0 0 1" xyaxes="0 -1 0 0 0 1" fovy="60"/>
    <camera name="tilted" pos="0 .5 1.5" xyaxes=".1 -1 0 .3 .03 1" fovy="75"/>
    <geom name="floor" type="box" size="5 5 .05" pos="0 0 -.05" material="chequer"/>
    <geom name="back" type="box" size=".05 5 3" pos="4.05 0 2" rgba=".8 .8 .8 1"/>
    <geom name="partition" type="box" size=".05 2 1" pos="2.05 -2 1" rgba=".2 .3 .8 1"/>
    <geom name="collision" type="box" size=".3 .3 .3" pos="1 0 1" group="3"/>
    <geom name="ceiling" type="box" size="5 5 .05" pos="0 0 3.05" group="1"/>
    <body name="ball" pos="3 1 1"><freejoint/><geom name="ball" size=".3" rgba=".9 .7 .1 1"/></body>
  </worldbody></mujoco>"""

PLAIN = RenderProfile("plain", textures=False, skybox=False)


@dataclass(frozen=True)
class Marker:
    position: tuple[float, ...]
    shape: str = "sphere"
    size: tuple[float, ...] = (0.15,)
    rgba: tuple[float, ...] = (1.0, 0.0, 0.0, 1.0)
    x_ray: bool = False


@pytest.fixture(scope="module")
def room():
    model = mujoco.MjModel.from_xml_string(ROOM)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


@pytest.fixture(scope="module")
def renderer(room):
    with Renderer(room[0], width=160, height=120, profile=PLAIN) as made:
        yield made


def red(image):
    values = image.astype(int)
    return (values[..., 0] > 120) & (values[..., 1:].max(axis=2) < values[..., 0] - 80)


def test_depth_of_a_facing_wall_is_its_distance_everywhere(room, renderer):
    """Distance along the axis, not along the ray: constant over a plane that faces the camera."""
    depth, ids = renderer.depth(room[1], "ahead"), renderer.segmentation(room[1], "ahead")
    assert depth.dtype == np.float32
    np.testing.assert_allclose(depth[ids == room[0].geom("back").id], 4.0, atol=1e-4)
    np.testing.assert_allclose(depth[ids == room[0].geom("partition").id].min(), 2.0, atol=1e-4)
    behind = CameraPose.looking_at((0, 0, 1), (-1, 0, 1), 1.0)
    open_air = renderer.segmentation(room[1], behind) == -1
    assert open_air.any() and np.isinf(renderer.depth(room[1], behind)[open_air]).all()


def test_collision_and_person_groups_are_hidden_unless_asked_for(room, renderer):
    hidden = room[0].geom("collision").id
    assert not (renderer.segmentation(room[1], "ahead") == hidden).any()
    with Renderer(room[0], width=32, height=32, profile=PLAIN, groups=(0, 3)) as other:
        ids = other.segmentation(room[1], "ahead")
    assert (ids == hidden).any()
    assert not (ids == room[0].geom("ceiling").id).any()


@pytest.mark.parametrize("profile", list(PROFILES))
def test_segmentation_is_the_same_in_every_profile(room, renderer, profile):
    """Supersampling and multisampling belong to colour; averaged ids would name wrong geoms."""
    expected = renderer.segmentation(room[1], "tilted")
    with Renderer(room[0], width=160, height=120, profile=profile) as other:
        got = other.segmentation(room[1], "tilted")
    assert (got == expected).mean() > 0.995
    assert set(np.unique(got)) <= set(np.unique(expected))


def test_frames_are_contiguous_and_upright(room, renderer):
    frame = renderer.rgb(room[1], "ahead")
    assert frame.shape == (120, 160, 3) and frame.dtype == np.uint8 and frame.flags.c_contiguous
    ids = renderer.segmentation(room[1], "ahead")
    assert ids[-1, 80] == room[0].geom("floor").id  # bottom row sees the floor
    blue = frame[..., 2].astype(int) > frame[..., 0].astype(int) + 40
    partition = ids == room[0].geom("partition").id
    assert (blue == partition).mean() > 0.99
    assert partition[:, 80:].sum() > 10 * partition[:, :79].sum()  # y < 0 is on the right


def test_frames_follow_the_data(room, renderer):
    model, data = room
    moved = mujoco.MjData(model)
    moved.qpos[:3] = 3, -0.5, 2.2
    mujoco.mj_forward(model, moved)
    ball = model.geom("ball").id
    was, now = (np.argwhere(renderer.segmentation(d, "ahead") == ball).mean(axis=0) for d in (data, moved))
    assert now[0] < was[0] and now[1] > was[1]  # higher, and further right


def test_a_pose_draws_what_the_named_camera_draws(room, renderer):
    for name in ("ahead", "tilted"):
        pose = renderer.camera_pose(room[1], name)
        np.testing.assert_array_equal(renderer.rgb(room[1], pose), renderer.rgb(room[1], name))
    view = renderer.camera_pose(room[1], "ahead")
    assert view.fovy == pytest.approx(np.pi / 3)
    pose = CameraPose.looking_at((0, 0, 1), (4, 0, 1), np.pi / 3)
    np.testing.assert_allclose(pose.rotation, view.rotation, atol=1e-12)
    down = CameraPose.looking_at((0, 0, 5), (0, 0, 0), 1.0)
    np.testing.assert_allclose(down.rotation, np.eye(3), atol=1e-12)


def test_combined_images_equal_the_separate_ones_and_stay_as_they_are(room, renderer):
    markers = [Marker((3, 0.3, 1), x_ray=True)]
    frame = renderer.frame(room[1], "tilted", markers, depth=True, segmentation=True)
    renderer.frame(room[1], "ahead", depth=True, segmentation=True)
    np.testing.assert_array_equal(frame.rgb, renderer.rgb(room[1], "tilted", markers))
    np.testing.assert_array_equal(frame.depth, renderer.depth(room[1], "tilted"))
    np.testing.assert_array_equal(frame.segmentation, renderer.segmentation(room[1], "tilted"))
    assert renderer.frame(room[1], "tilted", rgb=False).rgb is None


def drawn_with(room, **settings_):
    profile = RenderProfile("mine", textures=False, **settings_)
    with Renderer(room[0], width=160, height=120, profile=profile) as made:
        return made.rgb(room[1], "tilted").astype(int)


def test_shadows_only_darken_and_only_where_light_is_blocked(room):
    lit, shadowed = drawn_with(room), drawn_with(room, shadow_size=1024)
    darker = (shadowed < lit - 10).all(axis=2)
    assert 0.01 < darker.mean() < 0.9
    assert (shadowed <= lit + 1).all()


@pytest.mark.parametrize("smoothing", [{"samples": 4}, {"supersampling": 2.0}, {"supersampling": 1.5}])
def test_smoothing_mixes_colours_at_edges(room, smoothing):
    hard = drawn_with(room)
    difference = np.abs(drawn_with(room, **smoothing) - hard).max(axis=2) > 12
    edge = np.zeros(difference.shape, bool)
    edge[:, 1:] |= np.abs(np.diff(hard, axis=1)).max(axis=2) > 12
    edge[1:] |= np.abs(np.diff(hard, axis=0)).max(axis=2) > 12
    near_edge = cv2.dilate(edge.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    assert difference.sum() > 50
    assert near_edge.mean() < 0.5
    assert difference[near_edge].mean() > 20 * difference[~near_edge].mean()


def test_the_model_keeps_its_own_buffer_settings(room):
    vis = room[0].vis
    before = vis.global_.offwidth, vis.quality.shadowsize, vis.quality.offsamples
    with Renderer(room[0], width=1000, height=700, profile="quality"):
        pass
    assert before == (vis.global_.offwidth, vis.quality.shadowsize, vis.quality.offsamples)


@pytest.mark.parametrize(
    ("shape", "size", "area"),
    [
        ("sphere", (0.3,), np.pi * 0.3**2),
        ("cylinder", (0.1, 0.4), 0.2 * 0.8),
        ("box", (0.1, 0.2, 0.3), 0.4 * 0.6),
    ],
)
def test_markers_cover_their_projected_area(room, renderer, shape, size, area):
    """1.6 m ahead, 120 px over 2 * 1.6 * tan(30 deg) m; near sides look a little larger."""
    shown = red(renderer.rgb(room[1], "ahead", [Marker((1.6, 0, 1), shape, size)])).sum()
    scale = 120 / (2 * 1.6 * np.tan(np.pi / 6))
    assert 0.93 < shown / (area * scale**2) < 1.2


def test_walls_hide_markers_and_show_them_faintly_in_x_ray(room, renderer):
    """The partition's edge is at y = 0 in front of the camera's axis: image columns from 80 on hide what is behind."""

    def drawn(*places, **more):
        return renderer.rgb(room[1], "ahead", [Marker(place, **more) for place in places]).astype(int)

    plain = drawn()
    np.testing.assert_array_equal(drawn((3, -1.0, 0.8)), plain)
    assert red(drawn((1.5, -0.5, 0.9))).sum() > 100
    solid, x_ray = (drawn((3, 0, 0.7), size=(0.25,), x_ray=x_ray) for x_ray in (False, True))
    assert red(solid)[:, :79].sum() > 100 and red(solid)[:, 81:].sum() == 0
    np.testing.assert_array_equal(x_ray[:, :79], solid[:, :79])  # the visible half is not drawn twice
    hidden = (x_ray != plain).any(axis=2) & (np.arange(160) > 80)
    assert hidden.sum() > 100
    lines = [hidden & (x_ray == tone).all(axis=2) for tone in LINES]
    assert all(line.sum() > 10 for line in lines)
    inside = hidden & ~lines[0] & ~lines[1]
    np.testing.assert_allclose(x_ray[inside], 0.7 * plain[inside] + 0.3 * np.array([255, 0, 0]), atol=1.0)
    dull = drawn((3, 0, 0.7), size=(0.25,), rgba=(0.6, 0.4, 0.2, 1.0), x_ray=True)
    np.testing.assert_allclose(dull[inside], 0.7 * plain[inside] + 0.3 * np.array([153, 102, 51]), atol=1.0)
    np.testing.assert_array_equal(drawn((-3, 0, 1), (1, 40, 1), x_ray=True), plain)  # out of view


def test_markers_touch_neither_ids_nor_depth_unless_asked(room, renderer):
    marker = Marker((1, 0, 1))
    plain = renderer.frame(room[1], "ahead", depth=True, segmentation=True)
    marked = renderer.frame(room[1], "ahead", [marker], depth=True, segmentation=True)
    np.testing.assert_array_equal(plain.depth, marked.depth)
    np.testing.assert_array_equal(plain.segmentation, marked.segmentation)
    asked = renderer.depth(room[1], "ahead", [marker])
    assert asked[60, 80] == pytest.approx(0.85, abs=2e-3)


def test_markers_cast_no_shadow(room):
    with Renderer(room[0], width=160, height=120, profile="quality") as made:
        plain = made.rgb(room[1], "ahead").astype(int)
        marked = made.rgb(room[1], "ahead", [Marker((2.5, 0.8, 2.6), "box", (0.4, 0.4, 0.02))]).astype(int)
    below = slice(70, None)
    np.testing.assert_array_equal(plain[below], marked[below])


def test_markers_shine_alike_in_dark_and_lit_rooms():
    colours = []
    for ambient in (0.0, 0.6):
        model = mujoco.MjModel.from_xml_string(ROOM)
        model.vis.headlight.ambient[:] = ambient
        model.light_diffuse[:] = 0
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        with Renderer(model, width=32, height=32, profile=PLAIN) as made:
            colours.append(
                made.rgb(data, "ahead", [Marker((1, 0, 1), rgba=(0.9, 0.5, 0.2, 1))])[16, 16].astype(int)
            )
    assert np.abs(colours[0] - colours[1]).max() < 50
    assert colours[0][0] > 150


def test_unusable_markers_are_named(room, renderer):
    for marker, message in [
        (Marker((0, 0, 0), shape="cone"), "cone"),
        (Marker((0, 0, np.nan)), "position"),
        (Marker((0, 0, 0), size=(-1,)), "positive"),
        (Marker((0, 0, 0), shape="cylinder", size=(0.1,)), "size needs 2"),
        (Marker((0, 0, 0), rgba=(1, 0)), "rgba needs 4"),
    ]:
        with pytest.raises(RenderError, match=message):
            renderer.rgb(room[1], "ahead", [Marker((1, 0, 1)), marker])
    with pytest.raises(RenderError, match="markers in a frame"):
        renderer.rgb(room[1], "ahead", [Marker((0, 0, 0))] * 2000)
    assert not red(renderer.rgb(room[1], "ahead")).any()  # a refused frame leaves nothing behind


@settings(max_examples=80, deadline=None)
@given(
    st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(0.05, 20)),
    st.floats(0.01, 2.0),
    st.floats(0, 1),
    st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1)),
    st.booleans(),
)
def test_a_sphere_with_a_point_in_view_is_never_left_out(place, radius, share, direction, orthographic):
    view = ViewVolume(np.array([1.0, 2.0, 3.0]), np.eye(3), 0.7, orthographic=orthographic)
    x, y, ahead = place
    reach = 0.7 if orthographic else 0.7 * ahead
    x, y = np.clip(x, -1.3, 1.3) / 1.3 * reach * 1.5, np.clip(y, -1, 1) * reach
    point = view.position + np.array([x, y, -ahead])
    norm = np.linalg.norm(direction)
    centre = point + share * radius * np.array(direction) / max(norm, 1e-9)
    assert not outside(view, 1.5, centre[None], np.array([radius]))[0]


def test_planes_are_never_left_out():
    view = ViewVolume(np.zeros(3), np.eye(3), 0.7)
    far_behind = np.array([[0.0, 0.0, 50.0]])
    assert outside(view, 1.0, far_behind, np.array([1.0]))[0]
    assert not outside(view, 1.0, far_behind, np.array([0.0]))[0]


DM_CONTROL = "from dm_control.mujoco import Physics\n"


@pytest.mark.slow
@pytest.mark.parametrize(
    "rest", ["", DM_CONTROL, DM_CONTROL + "Physics.from_xml_string('<mujoco/>').render(8, 8)"]
)
def test_a_renderer_that_nobody_closed_leaves_no_noise_at_exit(rest):
    """Nor where dm_control terminates the display of the process before the renderer's own hook runs."""
    code = (
        "import mujoco; from mjsim.render import CameraPose, Renderer\n"
        "model = mujoco.MjModel.from_xml_string('<mujoco/>'); made = Renderer(model, width=8, height=8)\n"
        f"made.rgb(mujoco.MjData(model), CameraPose.looking_at((0, 0, 1), (0, 0, 0), 1.0))\n{rest}"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert run.stderr == ""


def test_renderers_of_several_models_interleave(room, renderer):
    other_model = mujoco.MjModel.from_xml_string(ROOM.replace('rgba=".2 .3 .8 1"', 'rgba="0 .9 0 1"'))
    other_data = mujoco.MjData(other_model)
    mujoco.mj_forward(other_model, other_data)
    expected = renderer.rgb(room[1], "ahead")
    with Renderer(other_model, width=64, height=64) as other:
        first = other.rgb(other_data, "ahead")
        np.testing.assert_array_equal(renderer.rgb(room[1], "ahead"), expected)
        np.testing.assert_array_equal(other.rgb(other_data, "ahead"), first)
    np.testing.assert_array_equal(renderer.rgb(room[1], "ahead"), expected)


def test_other_threads_may_draw_after_a_drawing_that_was_interrupted(room, renderer):
    """A signal may raise between the end of a drawing and the release of the context."""
    expected = renderer.rgb(room[1], "ahead")
    context._PROCESS._gl.make_current()
    assert np.array_equal(renderer.rgb(room[1], "ahead"), expected)
    with ThreadPoolExecutor(1) as pool:
        assert np.array_equal(pool.submit(renderer.rgb, room[1], "ahead").result(), expected)


def test_other_threads_may_draw(room, renderer):
    expected = {name: renderer.rgb(room[1], name) for name in ("ahead", "tilted")}
    wrong = []

    def draw(name):
        try:
            wrong.extend(
                1 for _ in range(10) if not np.array_equal(renderer.rgb(room[1], name), expected[name])
            )
        except Exception as error:
            wrong.append(error)

    threads = [threading.Thread(target=draw, args=(name,)) for name in ("ahead", "tilted") * 2]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_another_library_keeps_its_current_context(room, renderer):
    from mujoco import egl

    renderer.rgb(room[1], "ahead")
    foreign = egl.GLContext(1, 1)
    foreign.make_current()
    before = egl.EGL.eglGetCurrentContext().address
    renderer.rgb(room[1], "ahead")
    assert egl.EGL.eglGetCurrentContext().address == before
    foreign.free()


def test_unknown_names_and_sizes_are_refused(room, renderer):
    with pytest.raises(RenderError, match=r"no camera 'avatar/eye'.*ahead"):
        renderer.rgb(room[1])
    with pytest.raises(RenderError, match=r"no render profile 'best'.*draft"):
        Renderer(room[0], profile="best")
    for width in (0, -3, 100_000, 3.5):
        with pytest.raises(RenderError, match="frame sides"):
            Renderer(room[0], width=width)
    for change in ({"supersampling": 0.5}, {"samples": -1}, {"shadow_size": -1}):
        with pytest.raises(RenderError, match="profile 'mine'"):
            RenderProfile("mine", **change)


def test_unusable_poses_are_refused():
    origin, upright = np.zeros(3), np.eye(3)
    for *values, message in (
        (origin + np.inf, upright, 1.0, "position"),
        (origin, 2 * upright, 1.0, "orthonormal"),
        (origin, upright, 0.0, "fovy"),
    ):
        with pytest.raises(RenderError, match=message):
            CameraPose(*values)
    with pytest.raises(RenderError, match="cannot look"):
        CameraPose.looking_at((1, 2, 3), (1, 2, 3), 1.0)


def test_a_closed_renderer_and_foreign_data_are_refused(room):
    other = mujoco.MjModel.from_xml_string("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
    made = Renderer(room[0], width=32, height=32)
    with pytest.raises(RenderError, match="model of this data"):
        made.rgb(mujoco.MjData(other), CameraPose(np.zeros(3), np.eye(3), 1.0))
    made.close()
    made.close()
    for draw in (made.rgb, made.depth, made.segmentation, made.frame):
        with pytest.raises(RenderError, match="closed"):
            draw(room[1], "ahead")


def test_a_forked_worker_is_told_instead_of_hanging():
    code = (
        "import os; from mjsim.values.errors import RenderError; from mjsim.render import gl_info; gl_info()\n"
        "if os.fork() == 0:\n"
        "    try: gl_info()\n"
        "    except RenderError as e: os._exit(7 if 'spawn' in str(e) else 8)\n"
        "    os._exit(9)\n"
        "print(os.waitstatus_to_exitcode(os.wait()[1]))\n"
    )
    run = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    assert run.stdout.strip() == "7"
