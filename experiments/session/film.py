"""Create the fly-through film, with captions that name rooms and bins (PAPER section 7)."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from experiments.errors import ConfigError
from experiments.house import House
from experiments.session.camera_path import CameraPath, camera_path
from experiments.session.film_config import FilmConfig
from experiments.session.video import VideoWriter
from hud.compose import Captions
from mjsim.house.compiled.house import compiled_house
from mjsim.render import CameraPose, Renderer
from mjsim.support.files import replacing
from mjsim.values.person_parameters import PICTURE_ASPECT, PersonParameters

FPS = 25
MIN_DURATION = 1.0  # minimum length of a film in seconds

OnFrames = Callable[[int, int], None]


def write_flythrough(
    house: House,
    path: Path,
    film: FilmConfig,
    *,
    seconds: float | None = None,
    on_progress: OnFrames = lambda *_: None,
) -> str:
    """Write the fly-through film of a house atomically, and return the SHA-256 hash of its frames.

    By default, the film is as long as the camera path. `on_progress` receives the number of drawn frames
    and the total number. Equal arguments give the same hash. Raises ConfigError if `seconds` is less than 1.
    """
    if seconds is not None and seconds < MIN_DURATION:
        raise ConfigError(f"a film of {seconds} s is too short; it needs at least {MIN_DURATION:.0f} s")
    whole = camera_path(house)
    duration = seconds or whole.duration
    frames = round(duration * FPS)
    # Poses in the middle of each frame. At its beginning, rounding could repeat a pose and skip the next one.
    rows = whole.at((np.arange(frames, dtype=np.float64) + 0.5) * (whole.duration / frames))
    with replacing(path) as temporary:
        with VideoWriter(temporary, width=film.width, height=film.height, fps=FPS) as video:
            _draw(house, rows, film, video, on_progress)
        return video.frames_sha256


def _draw(
    house: House, rows: CameraPath, film: FilmConfig, video: VideoWriter, on_progress: OnFrames
) -> None:
    compiled, count = compiled_house(house.catalogue), len(rows.headings)
    # Use the horizontal field of view of a person, regardless of the film's aspect ratio.
    half = math.tan(PersonParameters().vertical_field / 2.0) * PICTURE_ASPECT * film.height / film.width
    captions = Captions(film.width, film.height)
    with Renderer(compiled.model, width=film.width, height=film.height, profile=film.profile) as renderer:
        for row in range(count):
            heading, pitch, eye = float(rows.headings[row]), float(rows.pitches[row]), rows.positions[row]
            gaze = [math.cos(heading) * math.cos(pitch), math.sin(heading) * math.cos(pitch), math.sin(pitch)]
            camera = CameraPose.looking_at(eye, eye + np.array(gaze), 2.0 * math.atan(half))
            frame = renderer.rgb(compiled.data, camera)
            room = house.rooms.label(house.rooms.room_at(eye[:2]))
            video.write(captions.over(frame, room, _bin_text(house, rows.bins[row])))
            on_progress(row + 1, count)


def _bin_text(house: House, key: str | None) -> str:
    if key is None:
        return ""
    entry = house.catalogue.receptacles[key]
    return f"{entry.label}: {entry.place}"
