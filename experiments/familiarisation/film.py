"""The fly-through film: the rooms of a house and its bins, with captions (PAPER section 7)."""

import hashlib
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from experiments.errors import ConfigError
from experiments.familiarisation.camera_path import CameraPath, camera_path
from experiments.house import House
from experiments.session.film_config import FilmConfig
from experiments.session.video import VideoWriter
from hud.caption import Captions
from mjsim.files import replacing
from mjsim.kernels import cache_base
from mjsim.model.house import compiled_house
from mjsim.person_parameters import PICTURE_ASPECT, PersonParameters
from mjsim.render import CameraPose, Renderer, gl_info

FPS = 25
SHORTEST = 1.0  # s

OnFrames = Callable[[int, int], None]


def write_flythrough(
    house: House,
    path: Path,
    film: FilmConfig,
    *,
    seconds: float | None = None,
    on_progress: OnFrames = lambda *_: None,
) -> str:
    """Film a house, whole or not at all; the same arguments give the same frames.

    Args:
        house: The house.
        path: MP4 file to write.
        film: Frame size and render profile.
        seconds: How long the film shall be, s; None for that of the camera's own speed.
        on_progress: Called with the numbers of frames that are drawn and of all.

    Returns:
        SHA-256 of the frames, pixel for pixel.

    Raises:
        ConfigError: The film would be shorter than 1 s.
        RenderError: No off-screen GL context can be made, or the size or profile is unusable.
        RecordError: The film cannot be encoded.
        OSError: The file cannot be written.
    """
    if seconds is not None and seconds < SHORTEST:
        raise ConfigError(f"a film of {seconds} s is too short; it takes {SHORTEST:.0f} s at least")
    whole = camera_path(house)
    duration = seconds or whole.duration
    frames = round(duration * FPS)
    rows = whole.at(np.linspace(0.0, whole.duration, frames, endpoint=False, dtype=np.float64))
    with replacing(path) as temporary:
        with VideoWriter(temporary, width=film.width, height=film.height, fps=FPS) as video:
            _draw(house, rows, film, video, on_progress)
        return video.frames_sha256


def cached_flythrough(house: House, film: FilmConfig, *, on_progress: OnFrames = lambda *_: None) -> Path:
    """The film of a house in the user's cache folder, filmed when it is not there yet.

    Its name holds a hash of what it shows: house, way of the camera, size, profile, and what drew it.

    Raises:
        RenderError, RecordError, OSError: As for `write_flythrough`.
    """
    path = camera_path(house)
    digest = hashlib.sha256(house.catalogue.content.encode())
    digest.update(np.column_stack([path.positions, path.headings, path.pitches]).tobytes())
    digest.update(f"{path.bins} {film} {gl_info().renderer}".encode())
    file = cache_base() / "flythrough" / f"{digest.hexdigest()[:16]}.mp4"
    if not file.is_file():
        write_flythrough(house, file, film, on_progress=on_progress)
    return file


def _draw(
    house: House, rows: CameraPath, film: FilmConfig, video: VideoWriter, on_progress: OnFrames
) -> None:
    compiled, count = compiled_house(house.catalogue), len(rows.headings)
    # As wide as what a person sees, in pictures of any shape.
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
    """What the film says of a bin: its name and where it stands."""
    if key is None:
        return ""
    entry = house.catalogue.receptacles[key]
    return f"{entry.label}: {entry.place}"
