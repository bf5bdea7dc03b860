"""Views from outside: the person is where the observation says, and the whole floor is in view."""

import math
from contextlib import closing

import numpy as np
import pytest

from experiments.session.film_config import FilmConfig
from experiments.trials.replay.external_view import ExternalViewer, camera_path
from mjsim.house.compiled.footprint import Footprint
from mjsim.world.world import World

BOUNDS = (-1.0, 2.0, 9.0, 8.0)
CORNERS = np.array([[-1.0, 2.0, 0.0], [9.0, 2.0, 0.0], [9.0, 8.0, 0.0], [-1.0, 8.0, 0.0]])


def project(pose, points, aspect):
    """Image coordinates, each in [-1, 1] where in view: x right, y up."""
    seen = (np.asarray(points) - pose.position) @ pose.rotation
    assert np.all(seen[:, 2] < 0.0)
    scale = 1.0 / math.tan(pose.fovy / 2)
    return seen[:, :2] / -seen[:, 2:] * [scale / aspect, scale]


@pytest.mark.parametrize("camera", ["top-down", "free"])
@pytest.mark.parametrize("aspect", [4 / 3, 16 / 9, 3 / 4])
@pytest.mark.parametrize("time", [0.0, 20.0, 61.0])
def test_the_whole_floor_is_in_view(camera, aspect, time):
    seen = project(camera_path(camera, BOUNDS, aspect)(time), CORNERS, aspect)
    assert np.abs(seen).max() < 1.0
    assert np.abs(seen).max() > 0.5


def test_north_is_up_from_above():
    seen = project(camera_path("top-down", BOUNDS, 1.0)(0.0), CORNERS, 1.0)
    assert np.all(np.sign(seen) == [[-1, -1], [1, -1], [1, 1], [-1, 1]])


def test_a_free_camera_circles_or_stands_where_it_is_put():
    circling = camera_path("free", BOUNDS, 1.0)
    assert np.linalg.norm(circling(10.0).position - circling(0.0).position) > 1.0
    still = camera_path("free", BOUNDS, 1.0, eye=(1.0, 2.0, 3.0), target=(4.0, 5.0, 0.5))
    for time in (0.0, 10.0):
        assert still(time).position.tolist() == [1.0, 2.0, 3.0]
        assert project(still(time), [[4.0, 5.0, 0.5]], 1.0) == pytest.approx(0.0, abs=1e-12)


class Frames:
    def __init__(self):
        self.frames = []

    def write(self, frame):
        self.frames.append(frame)


class NoMarkers:
    markers = ()

    def hud_state(self, _):
        return self


def test_the_person_is_seen_where_they_are(scene, house_footprint: Footprint):
    """The body's colour shows around the projected head and most of what is of that colour is there."""
    size, video = (480, 360), Frames()
    path = camera_path("top-down", house_footprint.bounds, size[0] / size[1])
    world = World(scene)
    observation = world.observation()
    with closing(ExternalViewer(scene, FilmConfig(*size, "draft"), path, video)) as viewer:
        viewer.show(world, observation, NoMarkers())
    frame = video.frames[0].astype(int)
    rows, columns = np.nonzero((frame[..., 0] > 2 * frame[..., 1]) & (frame[..., 2] > 1.5 * frame[..., 1]))
    assert 5 < len(rows) < 400
    x, y = project(path(0.0), [[*observation.position, 1.4]], size[0] / size[1])[0]
    assert np.median(columns) == pytest.approx((x + 1) / 2 * size[0], abs=5)
    assert np.median(rows) == pytest.approx((1 - y) / 2 * size[1], abs=5)
