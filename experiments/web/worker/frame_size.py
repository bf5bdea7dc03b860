"""Size and rate of frames, as the machine and the link allow."""

import statistics
import time
from collections.abc import Callable

SIZES = ((320, 240), (480, 360), (640, 480), (800, 600), (960, 720))  # px
FIRST_SIZE = 2
FRAMES = 20  # between two changes of the size
SLOW, QUICK = 0.033, 0.022  # s a frame may take before the size decreases, and at most to increase
HELD_UP = 0.06  # s a frame may wait for the link before the size decreases
SHARE = 0.65  # of the time that may be spent on drawing; the rest is left to other sessions
RETRY = 30.0  # s after which a size that was too large is tried again


class FrameSize:
    """Index of the size of the next frame, in `SIZES`. It decreases when frames take long or wait for the link."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.index, self._largest = FIRST_SIZE, len(SIZES) - 1
        self._clock = clock
        self._frames: list[tuple[float, float]] = []
        self._too_large = len(SIZES)
        self._retry_at = 0.0

    def limit(self, width: int, height: int) -> None:
        """No frame is larger than a view, px, unless that is smaller than the smallest."""
        fitting = [i for i, (w, h) in enumerate(SIZES) if w <= width and h <= height]
        self._largest = max(fitting, default=0)
        self._set(min(self.index, self._largest))

    def note(self, took: float, waited: float) -> None:
        """Note the time to draw and compress a frame, and how long it had waited for the link, s."""
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
    """Pause after a frame that took `took` seconds, s."""
    return took / SHARE - took
