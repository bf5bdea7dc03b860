"""A film has a poster, which is one of its own pictures."""

import base64

import cv2
import numpy as np

from experiments.session.video import VideoWriter
from experiments.web.worker.encoders import poster


def test_the_poster_is_the_key_frame_that_shows_most(tmp_path):
    empty = np.full((120, 160, 3), 128, np.uint8)
    blocks = np.random.default_rng(0).integers(0, 255, (12, 16, 3), np.uint8)
    full = np.ascontiguousarray(np.kron(blocks, np.ones((10, 10, 1), np.uint8)))
    with VideoWriter(tmp_path / "film.mp4", width=160, height=120) as video:
        for frame in [empty] * 60 + [full] * 60 + [empty] * 60:
            video.write(frame)
    kind, _, data = poster(tmp_path / "film.mp4").partition(",")
    assert kind == "data:image/webp;base64"
    shown = cv2.imdecode(np.frombuffer(base64.b64decode(data), np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    assert np.abs(shown.astype(int) - full).mean() < 12


def test_without_a_readable_film_there_is_none(tmp_path):
    (tmp_path / "film.mp4").write_bytes(b"a film")
    assert [poster(tmp_path / "film.mp4"), poster(tmp_path / "none.mp4")] == ["", ""]
