"""Compare breadcrumbs, flagpoles and the projection of the eye camera with independent geometry."""

import math

import cv2
import hud_sample as sample
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely import LineString, Point

from hud.errors import FrameError
from hud.markers import breadcrumbs, flagpole, pin
from hud.projection import CameraView, in_view, pointer_to, project

coordinates = st.floats(-8.0, 8.0).map(lambda v: round(v, 3))
paths = st.lists(st.tuples(coordinates, coordinates), min_size=2, max_size=7).map(np.array)


@given(paths, st.sampled_from((0.0, 0.5)), st.sampled_from((1.0, 1.6, 2.0)))
def test_breadcrumbs_follow_the_path_evenly_from_chest_height_to_the_floor(path, clearance, eye_height):
    line = LineString(path)
    marks = breadcrumbs(path, eye_height, clearance)
    assume(line.length > 0.01)
    if line.length < clearance:
        assert len(marks) == 1 and marks[0].position == pytest.approx((*path[-1], marks[0].size[0]))
        return
    points = np.array([m.position for m in marks])
    assert all(
        m.shape == "sphere" and m.role == "breadcrumb" and m.rgba[0] > 0.8 > 0.2 > m.rgba[1] for m in marks
    )
    assert max(line.distance(Point(p[:2])) for p in points) < 1e-6
    assert points[-1] == pytest.approx([*path[-1], marks[-1].size[0]], abs=1e-9)
    count = len(points)
    assert 0.28 * (count - 1) <= line.length - clearance + 1e-6 < 0.28 * count + 2e-6, "as many as fit"
    expected = [line.length - 0.28 * k for k in range(count - 1, -1, -1)]
    along = [line.interpolate(max(s, 0.0)).coords[0] for s in expected]  # clip positions before the start
    assert np.allclose(points[:, :2], along, atol=1e-6)
    chest = 0.75 * eye_height
    slope = (chest - 0.04) / line.length
    assert np.allclose(points[:, 2], [chest - slope * s for s in expected], atol=1e-6)


def test_a_person_at_the_goal_sees_one_breadcrumb_on_the_floor():
    for path in ([[1.0, 1.0]], [[1.0, 1.0], [1.0, 1.0]]):
        (mark,) = breadcrumbs(np.array(path), 1.6)
        assert mark.position == (1.0, 1.0, mark.size[0])


@pytest.mark.parametrize("make", [flagpole, pin])
def test_flags_and_pins_stand_over_their_place(make):
    marks = make((1.0, -2.0, 0.3))
    assert len({m.role for m in marks}) == 1
    for mark in marks:
        assert math.dist(mark.position[:2], (1.0, -2.0)) <= 0.12 and 0.3 <= mark.position[2] <= 1.8


rotations = st.tuples(st.floats(-3.1, 3.1), st.floats(-1.4, 1.4))
points = st.lists(st.tuples(*[st.floats(-9.0, 9.0)] * 3), min_size=1, max_size=8)


@given(rotations, points, st.floats(0.4, 2.2))
def test_projection_agrees_with_opencv(turn, where, fovy):
    camera = sample.camera(640, 480, yaw=turn[0], pitch=turn[1])
    camera = CameraView(np.array([0.5, -1.0, 1.6]), camera.rotation, fovy, 640, 480)
    pixels, depth = project(camera, where)
    vision = np.diag([1.0, -1.0, -1.0]) @ camera.rotation.T  # camera axes: right, down, forward
    lens = np.array([[camera.focal, 0.0, 320.0], [0.0, camera.focal, 240.0], [0.0, 0.0, 1.0]])
    ahead = depth > 0.05
    expected_depth = (np.asarray(where, dtype=np.float64) - camera.position) @ vision[2]
    assert np.allclose(depth, expected_depth, atol=1e-9)
    assert np.isnan(pixels[depth < 0]).all()
    if ahead.any():
        target = np.asarray(where, dtype=np.float64)[ahead]
        expected, _ = cv2.projectPoints(
            target, cv2.Rodrigues(vision)[0], -vision @ camera.position, lens, None
        )
        assert np.allclose(pixels[ahead], expected[:, 0], rtol=1e-6, atol=1e-4)


def test_the_centre_and_the_edge_of_the_view():
    camera = CameraView(
        np.zeros(3), np.eye(3), math.pi / 2, 640, 480
    )  # looks along -z, and sees 45 degrees up and down
    pixels, _ = project(camera, [(0, 0, -2), (0, 2, -2), (2, 0, -2)])
    assert np.allclose(pixels, [[320, 240], [320, 0], [560, 240]])
    assert (
        in_view(camera, (0, 1.9, -2)) and not in_view(camera, (0, 2.1, -2)) and not in_view(camera, (0, 0, 2))
    )


@pytest.mark.parametrize(
    ("target", "angle"),
    [
        ((9.0, 0.0, -1.0), 0.0), ((-9.0, 0.0, -1.0), math.pi), ((0.0, 9.0, -1.0), math.pi / 2),
        ((0.0, -9.0, -1.0), -math.pi / 2), ((1.0, 0.0, 5.0), 0.0), ((-1.0, 3.0, 5.0), math.pi),
    ],
)  # fmt: skip
def test_the_pointer_says_which_way_to_turn(target, angle):
    camera = CameraView(np.zeros(3), np.eye(3), 1.0, 640, 480)
    pointer = pointer_to(camera, target)
    assert pointer is not None and pointer.angle == pytest.approx(angle)
    assert pointer_to(camera, (0.0, 0.0, -3.0)) is None


@pytest.mark.parametrize(
    "change",
    [{"position": np.zeros(2)}, {"rotation": 2 * np.eye(3)}, {"fovy": 0.0}, {"fovy": 3.2}, {"width": 0}],
)
def test_an_impossible_camera_is_refused(change):
    good = {"position": np.zeros(3), "rotation": np.eye(3), "fovy": 1.0, "width": 640, "height": 480}
    with pytest.raises(FrameError, match="camera"):
        CameraView(**{**good, **change})
