"""Write H.264 videos for browsers, and encode them in a separate thread."""

import hashlib
import queue
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, suppress
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
from numpy.typing import NDArray

from experiments.errors import ConfigError, RecordError

Image = NDArray[np.uint8]
QUEUE_LENGTH = 8  # maximum number of frames that wait to be encoded


class VideoWriter(AbstractContextManager["VideoWriter"]):
    """A writer of MP4 files. Use it as a context manager so that the file is completed.

    Width and height in pixels must be even because chroma is subsampled (4:2:0). Raises RecordError if one of them is
    odd, or if the encoder failed.
    """

    def __init__(self, path: Path, *, width: int, height: int, fps: int = 25) -> None:
        if width % 2 or height % 2:
            raise RecordError(f"video size must be even in both directions, got {width}x{height}")
        self._path = path
        self._shape = (height, width, 3)
        self._fps = fps
        self._queue: queue.Queue[Image | None] = queue.Queue(QUEUE_LENGTH)
        self._hash = hashlib.sha256()
        self._failure: BaseException | None = None
        self._thread = threading.Thread(target=self._encode, name="video", daemon=True)
        self._thread.start()

    @property
    def frames_sha256(self) -> str:
        """SHA-256 hash of the frames encoded so far. The hash is final after `close`."""
        return self._hash.hexdigest()

    def write(self, frame: Image) -> None:
        """Append an RGB frame, uint8, shape (height, width, 3), which the caller must not change afterwards.

        Raises RecordError if the frame has another shape, or if the encoder failed.
        """
        if frame.shape != self._shape:
            raise RecordError(f"frame of shape {frame.shape} does not fit a video of shape {self._shape}")
        self._raise_failure()
        self._queue.put(frame)

    def close(self) -> None:
        """Encode the queued frames and complete the file. Raises RecordError if the encoder failed."""
        self._queue.put(None)
        self._thread.join()
        self._raise_failure()

    def __exit__(self, *_: object) -> None:
        self.close()

    def _raise_failure(self) -> None:
        if self._failure is not None:
            raise RecordError(f"cannot encode {self._path}: {self._failure}") from self._failure

    def _encode(self) -> None:
        frames = self._frames()
        try:
            self._encode_all(frames)
        except BaseException as failure:  # raised again later, in the thread that adds frames
            self._failure = failure
            for _ in frames:
                pass

    def _frames(self) -> Iterator[Image]:
        while (frame := self._queue.get()) is not None:
            yield frame

    def _encode_all(self, frames: Iterator[Image]) -> None:
        height, width, _ = self._shape
        # faststart puts the index first, so that a browser can play the file while loading it.
        with av.open(str(self._path), "w", options={"movflags": "+faststart"}) as container:
            # With one thread x264 is deterministic, and the renderer can use the other cores.
            stream = container.add_stream(
                "libx264", rate=self._fps, options={"preset": "veryfast", "crf": "22", "threads": "1"}
            )
            stream.width, stream.height = width, height
            stream.pix_fmt = "yuv420p"
            stream.time_base = Fraction(1, self._fps)
            for frame in frames:
                self._hash.update(np.ascontiguousarray(frame).data)
                container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="rgb24")))
            container.mux(stream.encode())


def check_film(path: Path | None) -> None:
    """Raise ConfigError if a file is missing or is not an MP4 video. None, for no film, is accepted."""
    if path is None:
        return
    fault = "is not an MP4 video" if path.is_file() else "does not exist"
    with suppress(OSError, ValueError), path.open("rb") as file, av.open(file) as film:  # or errors of FFmpeg
        fault = "" if "mp4" in film.format.name and film.streams.video else fault
    if fault:
        raise ConfigError(f"film {path} {fault}; leave out --film, or name an MP4 file")
