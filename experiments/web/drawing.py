"""Draws what the person sees in a thread of its own: the newest state, as large and as often as possible."""

import copy
import dataclasses
import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from experiments.house import House
from experiments.session.film_config import FilmConfig
from experiments.session.first_person import FirstPersonRenderer
from experiments.web.encoders import Encoder, H264Encoder, Image, JpegEncoder
from experiments.web.messages import Frame, View
from hud.projection import CameraView
from hud.state import HudState
from mjsim.model.avatar import EYE
from mjsim.model.scene import Scene
from mjsim.render.cameras import camera_pose

SIZES = ((320, 240), (480, 360), (640, 480), (800, 600), (960, 720))
FIRST_SIZE = 2
ASPECT = 4 / 3  # of all sizes
MAX_IN_FLIGHT = 3  # frames sent that the browser has not yet shown
SLOW, QUICK = 45.0, 14.0  # ms a frame may take before the size goes down, and may take to go up
PATIENCE = 20  # frames between two changes of the size


@dataclass(frozen=True, eq=False)
class Snapshot:
    """What is to be drawn: a copy of the simulator's data, what the HUD shows, the control step, the last input."""

    data: Any
    state: HudState
    step: int
    input: int


class Drawer:
    """Draws snapshots and hands frames on. Use as a context manager.

    Args:
        scene: The scene.
        house: The house, for pictures.
        pictures: Gives what `render_pictures` made of the house's catalogue; called from the drawing thread.
        send: Takes the frames; called from the drawing thread.
    """

    def __init__(
        self,
        scene: Scene,
        house: House,
        pictures: Callable[[], dict[str, Image]],
        send: Callable[[Frame], None],
    ) -> None:
        self._scene, self._house, self._pictures, self._send = scene, house, pictures, send
        self._changed = threading.Condition()
        self._view: View | None = None
        self._snapshot: Snapshot | None = None
        self._drawn: object = None
        self._sent = self._seen = 0
        self._key = self._closed = False
        self._renderers: dict[int, FirstPersonRenderer] = {}
        self._thread = threading.Thread(target=self._run, name="drawing", daemon=True)
        self._thread.start()

    def show_to(self, view: View) -> None:
        """Draw for a browser that has just connected; its first frame is a key frame."""
        with self._changed:
            self._view, self._key, self._drawn = view, True, None
            self._sent = self._seen = 0
            self._changed.notify()

    def camera_view(self, data: Any) -> CameraView:
        """The eye camera, in the shape of the frames."""
        pose = camera_pose(self._scene.model, data, EYE, ASPECT)
        return CameraView(pose.position, pose.rotation, pose.fovy, *SIZES[FIRST_SIZE])

    def seen(self, frame: int) -> None:
        """The browser has shown a frame."""
        with self._changed:
            self._seen = max(self._seen, min(frame, self._sent))
            self._changed.notify()

    def offer(self, data: Any, state: HudState, step: int, number: int) -> None:
        """Take what is to be drawn next, unless nothing of it has changed; what was not drawn yet is dropped."""
        if self._view is None or self._view.codec == "none":
            return
        with self._changed:
            self._snapshot = Snapshot(copy.copy(data), state, step, number)
            self._changed.notify()

    def close(self) -> None:
        """Stop drawing."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join()

    def __enter__(self) -> "Drawer":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self) -> None:
        size, encoder, encoded_for, since = FIRST_SIZE, None, None, 0
        while (job := self._next()) is not None:
            snapshot, view, key = job
            began = time.perf_counter()
            size = min(size, largest_size(view))
            if encoded_for != (view, size):
                encoder, encoded_for, since, key = _encoder(view, size), (view, size), 0, True
            image = self._renderer(size).frame(snapshot.data, snapshot.state)
            data, is_key = encoder.encode(image, key=key) if encoder else (b"", False)
            took = 1000.0 * (time.perf_counter() - began)
            with self._changed:
                if self._view is not view:
                    continue
                self._sent += 1
                number = self._sent
            width, height = SIZES[size]
            self._send(
                Frame(
                    number,
                    snapshot.step,
                    snapshot.input,
                    view.codec,
                    is_key,
                    width,
                    height,
                    round(took, 2),
                    data,
                )
            )
            since += 1
            if since >= PATIENCE:
                size, since = fitting_size(size, took), 0 if fitting_size(size, took) != size else since
        for renderer in self._renderers.values():
            renderer.close()

    def _next(self) -> tuple[Snapshot, View, bool] | None:
        """Wait for something new to draw, and for the browser to keep up; None once closed."""
        with self._changed:
            while not self._closed:
                snapshot, view = self._snapshot, self._view
                if snapshot is not None and view is not None and self._sent - self._seen < MAX_IN_FLIGHT:
                    self._snapshot, content = None, _content(snapshot)
                    if content != self._drawn:
                        self._drawn, key, self._key = content, self._key, False
                        return snapshot, view, key
                else:
                    self._changed.wait()
        return None

    def _renderer(self, size: int) -> FirstPersonRenderer:
        if size not in self._renderers:
            width, height = SIZES[size]
            film = FilmConfig(width, height)
            self._renderers[size] = FirstPersonRenderer(self._scene, self._house, film, self._pictures())
        return self._renderers[size]


def largest_size(view: View) -> int:
    """Index of the largest size that is not larger than a view."""
    fitting = [i for i, (width, height) in enumerate(SIZES) if width <= view.width and height <= view.height]
    return max(fitting, default=0)


def fitting_size(size: int, milliseconds: float) -> int:
    """The size to go on with after a frame that took so long."""
    if milliseconds > SLOW:
        return max(0, size - 1)
    return min(len(SIZES) - 1, size + 1) if milliseconds < QUICK else size


def _encoder(view: View, size: int) -> Encoder:
    return H264Encoder(*SIZES[size]) if view.codec == "h264" else JpegEncoder()


def _content(snapshot: Snapshot) -> tuple[bytes, HudState]:
    """What a frame depends on; the clock shows whole seconds."""
    state = snapshot.state
    clock = None if state.clock is None else float(math.floor(state.clock))
    return snapshot.data.qpos.tobytes(), dataclasses.replace(state, clock=clock)
