"""The fly-through film: where the camera is in each frame, where it looks, and what the captions say."""

import math

import numpy as np
import pytest

from experiments.errors import ConfigError
from experiments.session import film
from experiments.session.camera_path import (
    BIN_DISTANCES,
    EYE_HEIGHT,
    SPEED,
    STEP,
    CameraPath,
    _Camera,
    camera_path,
)
from experiments.session.film import FPS, write_flythrough
from experiments.session.film_config import FilmConfig
from mjsim.house.compiled.house import compiled_house
from mjsim.house.sight.sight import FieldOfView, visible_receptacles
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.walking.polyline import path_length, point_along

SMALL = FilmConfig(320, 240, "draft")


class Drawer:
    """A renderer, a caption and a video writer in one. It keeps what it is asked to draw and to write."""

    frames_sha256 = "hash"

    def __init__(self):
        self.cameras, self.captions, self.frames, self.made = [], [], [], []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def make(self, **options):
        self.made.append(options)
        return self

    def rgb(self, _, camera):
        self.cameras.append(camera)
        return len(self.cameras)

    def over(self, frame, room, bin_text):
        self.captions.append((room, bin_text))
        return "captioned", frame

    def write(self, frame):
        self.frames.append(frame)


@pytest.fixture
def drawer(monkeypatch):
    found = Drawer()
    monkeypatch.setattr(film, "Renderer", lambda _, **options: found.make(**options))
    monkeypatch.setattr(
        film, "VideoWriter", lambda path, **options: path.write_bytes(b"film") and found.make(**options)
    )
    monkeypatch.setattr(film, "Captions", lambda width, height: found.make(width=width, height=height))
    return found


def filmed(house, tmp_path, **options):
    path, progress = tmp_path / "film.mp4", []
    digest = write_flythrough(
        house, path, SMALL, on_progress=lambda done, total: progress.append((done, total)), **options
    )
    assert (digest, path.read_bytes()) == ("hash", b"film")
    return progress


def test_each_frame_is_seen_from_the_path_along_the_gaze_with_the_field_of_a_person(house, drawer, tmp_path):
    path = camera_path(house)
    progress = filmed(house, tmp_path)
    count = len(path.headings)
    assert len(drawer.cameras) == count == round(path.duration * FPS)
    assert drawer.frames == [("captioned", k + 1) for k in range(count)], "in order"
    assert progress == [(k + 1, count) for k in range(count)]
    positions = np.array([camera.position for camera in drawer.cameras])
    gazes = np.array([-camera.rotation[:, 2] for camera in drawer.cameras])
    assert positions == pytest.approx(path.positions)
    assert np.arctan2(gazes[:, 1], gazes[:, 0]) == pytest.approx(
        np.angle(np.exp(1j * path.headings)), abs=1e-9
    )
    assert np.arcsin(gazes[:, 2]) == pytest.approx(path.pitches)
    field = FieldOfView.of(PersonParameters())
    for camera in drawer.cameras[:3]:
        across = 2.0 * math.atan(math.tan(camera.fovy / 2.0) * SMALL.width / SMALL.height)
        assert across == pytest.approx(field.horizontal)
    size = {"width": 320, "height": 240}
    assert drawer.made == [{**size, "fps": FPS}, size, {**size, "profile": "draft"}]


def test_captions_name_the_room_and_the_bin_that_is_looked_at(house, drawer, tmp_path):
    path = camera_path(house)
    filmed(house, tmp_path)
    for row in range(0, len(path.bins), 7):
        room, bin_text = drawer.captions[row]
        assert room == house.rooms.label(house.rooms.room_at(path.positions[row, :2]))
        key = path.bins[row]
        entry = None if key is None else house.catalogue.receptacles[key]
        assert bin_text == ("" if entry is None else f"{entry.label}: {entry.place}")
    assert len({text for _, text in drawer.captions}) == 1 + len(house.receptacles)


@pytest.mark.parametrize("seconds", [1.0, 10.0])
def test_a_film_of_another_length_shows_the_whole_path_faster_or_slower(house, drawer, tmp_path, seconds):
    path = camera_path(house)
    filmed(house, tmp_path, seconds=seconds)
    count = round(seconds * FPS)
    assert len(drawer.cameras) == count
    rows = [int((k + 0.5) * len(path.headings) / count) for k in range(count)]
    positions = np.array([camera.position for camera in drawer.cameras])
    assert positions == pytest.approx(path.positions[rows])
    with pytest.raises(ConfigError, match="too short; it needs at least 1 s"):
        write_flythrough(house, tmp_path / "short.mp4", SMALL, seconds=0.99)


def test_the_walking_camera_looks_level_along_its_way_and_turns_into_it_before_it_walks(house):
    path = camera_path(house)
    moves = np.diff(path.positions[:, :2], axis=0)
    walks = np.linalg.norm(moves, axis=1) > 0.7 * SPEED * STEP
    gaze = path.headings[:-1]
    off = [math.remainder(h - math.atan2(dy, dx), math.tau) for h, (dx, dy) in zip(gaze, moves, strict=True)]
    assert walks.sum() > 500
    assert np.abs(off)[walks].max() < 0.6 and np.median(np.abs(off)[walks]) < 0.1
    assert np.abs(path.pitches[:-1][walks]).max() < 0.1
    assert np.linalg.norm(moves, axis=1).sum() < 1.1 * 0.04 * walks.sum() * SPEED


def test_each_bin_is_shown_from_the_farthest_of_its_distances_from_which_it_is_visible(house):
    path, compiled = camera_path(house), compiled_house(house.catalogue)
    field = FieldOfView.of(PersonParameters())
    for key, bin_ in house.receptacles.items():
        middle = house.viewpoints[house.catalogue.receptacles[key].room][0]
        way = np.array(house.geodesics.shortest_path(middle, house.approaches[key]).points)
        for distance in BIN_DISTANCES:
            place = np.array(point_along(way, max(0.0, path_length(way) - distance)))
            eye = np.array([*place, EYE_HEIGHT])
            ahead, left, up = (bin_.center - eye).tolist()
            gaze = math.atan2(left, ahead), math.atan2(up, math.hypot(ahead, left))
            if visible_receptacles(compiled.model, compiled.data, {key: bin_}, eye, *gaze, field=field):
                break
        rest = path.positions[path.bins.index(key) + 25, :2]
        assert rest == pytest.approx(place, abs=0.01)


@pytest.mark.parametrize("left", [0, 1])
def test_a_camera_that_is_already_there_does_not_move(house, left):
    start = np.array(house.viewpoints["living_room"][0])
    camera = _Camera(house, start)
    camera.move(start + np.array([0.0, 1e-8 * left]))
    assert (camera.rows, camera.bins) == ([], [])


def test_a_path_is_read_at_any_time_up_to_its_end():
    count = 5
    path = CameraPath(
        np.arange(15.0).reshape(5, 3), np.arange(5.0), -np.arange(5.0), (None, "a", "a", "b", None)
    )
    assert path.duration == count * STEP
    at = path.at(np.array([0.0, 1.5 * STEP, 4.9 * STEP, 99.0]))
    assert at.headings.tolist() == [0.0, 1.0, 4.0, 4.0]
    assert at.pitches.tolist() == [0.0, -1.0, -4.0, -4.0]
    assert at.positions.tolist() == path.positions[[0, 1, 4, 4]].tolist()
    assert at.bins == (None, "a", None, None)
