"""Frames compressed for a browser: JPEG, or H.264 with little delay."""

import base64
from typing import Any, Protocol

import av
import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
QUALITY = 75  # of JPEG
H264_OPTIONS = {
    "preset": "superfast",
    "tune": "zerolatency",
    "crf": "26",
    "profile": "baseline",
    "threads": "1",
}
KEY_EVERY = 250  # frames


class Encoder(Protocol):
    """Compresses frames of one size."""

    def encode(self, frame: Image, *, key: bool) -> tuple[bytes, bool]:
        """A frame, uint8 RGB (h, w, 3), compressed, and whether it can be decoded by itself; `key` requests that."""
        ...


class JpegEncoder:
    """Every frame by itself."""

    def encode(self, frame: Image, *, key: bool) -> tuple[bytes, bool]:  # noqa: ARG002 - each is a key frame
        """See `Encoder`."""
        _, data = cv2.imencode(".jpg", frame[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
        return data.tobytes(), True


class H264Encoder:
    """A stream without delay: one packet in Annex B per frame. Width and height are even."""

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
        """See `Encoder`."""
        picture = av.VideoFrame.from_ndarray(frame, format="rgb24").reformat(format="yuv420p")
        picture.pts, self._count = self._count, self._count + 1
        picture.pict_type = av.video.frame.PictureType.I if key else av.video.frame.PictureType.NONE
        packets = self._codec.encode(picture)
        return b"".join(bytes(packet) for packet in packets), any(packet.is_keyframe for packet in packets)


def data_url(picture: Image) -> str:
    """A picture, uint8 RGBA (h, w, 4), as the data URL of a WebP."""
    _, data = cv2.imencode(
        ".webp", cv2.cvtColor(picture, cv2.COLOR_RGBA2BGRA), [cv2.IMWRITE_WEBP_QUALITY, 85]
    )
    return f"data:image/webp;base64,{base64.b64encode(data.tobytes()).decode()}"
