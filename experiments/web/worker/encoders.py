"""Compress frames as JPEG or low-latency H.264."""

import base64
import statistics
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

import av
import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
QUALITY = 75
H264_OPTIONS = {
    "preset": "superfast",
    "tune": "zerolatency",
    "crf": "26",
    "profile": "baseline",
    "threads": "1",
}
KEY_EVERY = 250  # maximum number of frames from one key frame to the next


class Encoder(Protocol):
    """The interface of an encoder for frames of a fixed size."""

    def encode(self, frame: Image, *, key: bool) -> tuple[bytes, bool]:
        """Compress a uint8 RGB frame (h, w, 3), as a key frame if `key` is true.

        Return the compressed bytes, and True if the result is a key frame.
        """
        ...


class JpegEncoder:
    """A JPEG encoder. Each frame is a key frame."""

    def encode(self, frame: Image, *, key: bool) -> tuple[bytes, bool]:  # noqa: ARG002 - each is a key frame
        _, data = cv2.imencode(".jpg", frame[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        return data.tobytes(), True


class H264Encoder:
    """A low-latency H.264 encoder with one Annex B packet per frame. Width and height must be even."""

    def __init__(self, width: int, height: int) -> None:
        self._codec: Any = av.CodecContext.create("libx264", "w")
        self._codec.width, self._codec.height = width, height
        self._codec.pix_fmt = "yuv420p"
        self._codec.framerate = 25
        self._codec.gop_size = KEY_EVERY
        self._codec.max_b_frames = 0
        self._codec.options = H264_OPTIONS
        self._count = 0

    def encode(self, frame: Image, *, key: bool) -> tuple[bytes, bool]:
        picture = av.VideoFrame.from_ndarray(frame, format="rgb24").reformat(format="yuv420p")
        picture.pts, self._count = self._count, self._count + 1
        picture.pict_type = av.video.frame.PictureType.I if key else av.video.frame.PictureType.NONE
        packets = self._codec.encode(picture)
        return b"".join(bytes(packet) for packet in packets), any(packet.is_keyframe for packet in packets)


def data_url(picture: Image) -> str:
    """Encode a uint8 RGBA picture (h, w, 4) as a data URL in WebP format."""
    _, data = cv2.imencode(
        ".webp", cv2.cvtColor(picture, cv2.COLOR_RGBA2BGRA), [cv2.IMWRITE_WEBP_QUALITY, 85]
    )
    return f"data:image/webp;base64,{base64.b64encode(data.tobytes()).decode()}"


def poster(film: Path) -> str:
    """Return the most detailed key frame of a film as a data URL, or an empty text if the film cannot be read."""
    # FFmpeg's errors are OSErrors or ValueErrors
    with suppress(OSError, ValueError, IndexError), film.open("rb") as file, av.open(file) as container:
        stream = container.streams.video[0]
        keys = [packet for packet in container.demux(stream) if packet.is_keyframe]
        codec = stream.codec_context
        frames = [*codec.decode(max(keys, key=lambda key: key.size)), *codec.decode(None)]
        return data_url(frames[0].to_ndarray(format="rgba"))
    return ""


SIZES = ((320, 240), (480, 360), (640, 480), (800, 600), (960, 720))  # possible frame sizes, in pixels
FIRST_SIZE = 2
FRAMES = 20  # number of frames from which median times are computed
# Times to draw a frame above which frames become smaller, and below which they become larger, in seconds
SLOW, QUICK = 0.033, 0.022
HELD_UP = 0.06  # waiting time for the connection above which frames become smaller, in seconds
SHARE = 0.65  # fraction of time spent on drawing; the rest is left to other sessions
RETRY = 30.0  # time until a size that was too large is tried again, in seconds


class FrameSize:
    """A frame size from `SIZES` that adapts to the speed of drawing and of the connection."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.index, self._largest = FIRST_SIZE, len(SIZES) - 1
        self._clock = clock
        self._frames: list[tuple[float, float]] = []
        self._too_large = len(SIZES)
        self._retry_at = 0.0

    def limit(self, width: int, height: int) -> None:
        """Limit the frame size to the size of a view in pixels. The smallest frame size is always allowed."""
        fitting = [i for i, (w, h) in enumerate(SIZES) if w <= width and h <= height]
        self._largest = max(fitting, default=0)
        self._set(min(self.index, self._largest))

    def note(self, took: float, waited: float) -> None:
        """Record the time in seconds to produce a frame, and how long it had to wait for the connection."""
        self._frames.append((took, waited))
        if len(self._frames) < FRAMES:
            return
        took, waited = (statistics.median(times) for times in zip(*self._frames, strict=True))
        del self._frames[0]
        if waited > HELD_UP or took > SLOW:
            self._too_large, self._retry_at = self.index, self._clock() + RETRY
            self._set(max(0, self.index - 1))
        elif took < QUICK and (self.index + 1 < self._too_large or self._clock() > self._retry_at):
            self._set(min(self._largest, self.index + 1))

    def _set(self, index: int) -> None:
        if index != self.index:
            self.index, self._frames = index, []


def pause_after(took: float) -> float:
    """Return the length of the pause after a frame that took `took` seconds to draw, in seconds."""
    return took / SHARE - took
