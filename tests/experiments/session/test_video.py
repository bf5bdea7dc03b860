"""The video plays in browsers, holds every frame, and repeats byte for byte."""

import threading
from contextlib import contextmanager, suppress

import av
import numpy as np
import pytest

from experiments.errors import RecordError
from experiments.session.video import VideoWriter


def frames(count=30):
    rng = np.random.default_rng(0)
    base = rng.integers(0, 255, (12, 16, 3), np.uint8)
    return [
        np.ascontiguousarray(np.kron(np.roll(base, k, axis=1), np.ones((10, 10, 1), np.uint8)))
        for k in range(count)
    ]


def write(path, images):
    with VideoWriter(path, width=160, height=120) as video:
        for image in images:
            video.write(image)
    return video.frames_sha256


def test_every_frame_is_there_in_a_format_that_browsers_play(tmp_path):
    images = frames()
    write(tmp_path / "v.mp4", images)
    with av.open(str(tmp_path / "v.mp4")) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert float(stream.average_rate) == 25.0
        decoded = [f.to_ndarray(format="rgb24") for f in container.decode(video=0)]
    assert len(decoded) == len(images)
    for shown, image in zip(decoded, images, strict=True):
        assert np.abs(shown.astype(int) - image).mean() < 12


def test_the_same_frames_give_the_same_bytes_and_hash(tmp_path):
    images = frames()
    hashes = [write(tmp_path / name, images) for name in ("a.mp4", "b.mp4")]
    assert hashes[0] == hashes[1]
    assert (tmp_path / "a.mp4").read_bytes() == (tmp_path / "b.mp4").read_bytes()
    images[7][0, 0] += 1
    assert write(tmp_path / "c.mp4", images) != hashes[0]


def test_odd_sizes_and_a_frame_of_another_size_are_refused(tmp_path):
    for width, height in ((161, 120), (160, 121)):
        with pytest.raises(RecordError, match="even"):
            VideoWriter(tmp_path / "v.mp4", width=width, height=height)
    with VideoWriter(tmp_path / "v.mp4", width=160, height=120) as video:
        with pytest.raises(RecordError, match="does not fit"):
            video.write(np.zeros((100, 160, 3), np.uint8))
        video.write(np.zeros((120, 160, 3), np.uint8))


def test_an_encoder_failure_reaches_the_caller(tmp_path):
    video = VideoWriter(tmp_path / "no such folder" / "v.mp4", width=160, height=120)
    with pytest.raises(RecordError, match="cannot encode"):
        for image in frames(40):
            video.write(image)
        video.close()


def test_a_failure_while_the_file_is_completed_reaches_the_caller(tmp_path, monkeypatch):
    """As on a disk that is full by then."""
    opened, failures = av.open, []

    @contextmanager
    def full(*args, **options):
        with opened(*args, **options) as container:
            yield container
        raise OSError(28, "No space left on device")

    def close():
        with suppress(RecordError):
            video.close()
            return
        failures.append("raised")

    monkeypatch.setattr(av, "open", full)
    video = VideoWriter(tmp_path / "v.mp4", width=160, height=120)
    closing = threading.Thread(target=close, daemon=True)
    closing.start()
    closing.join(30.0)
    assert failures == ["raised"], "it does not wait for ever"
