"""Draw the participant's view at a size and frame rate that the browser and the worker can handle."""

import dataclasses
import threading
import time
from collections.abc import Callable
from typing import Any, NamedTuple

from experiments.errors import describe
from experiments.web.protocol import FrameMessage, View
from experiments.web.state import RUNNING, Pictures, Trigger
from experiments.web.worker.clock import Send
from experiments.web.worker.control import SessionControl
from experiments.web.worker.encoders import SIZES, Encoder, FrameSize, H264Encoder, JpegEncoder, pause_after
from hud.state import HudState, Marker
from mjsim.house.scene.scene import Scene
from mjsim.render import FAST, Renderer
from mjsim.world.world import World

COARSE = dataclasses.replace(FAST, name="coarse", supersampling=1.0)  # profile for the smallest frame size
MAX_IN_FLIGHT = 3  # maximum number of sent frames that the browser has not yet shown


class _Moment(NamedTuple):
    data: Any  # copy of the simulator's `MjData`
    markers: tuple[Marker, ...]
    step: int
    input: int
    hidden: bool  # True if the frame is black because the clock is stopped

    def content(self) -> object:
        return self.hidden or (self.data.qpos.tobytes(), self.markers)


class _Job(NamedTuple):
    moment: _Moment
    view: View
    key: bool
    waited: float  # time spent waiting for the connection, in seconds


class Drawer:
    """A thread that draws frames and sends them. If drawing fails, the session fails."""

    def __init__(
        self,
        scene: Scene,
        pictures: Callable[[], Pictures],
        send: Send,
        control: SessionControl,
    ) -> None:
        self._scene, self.pictures = scene, pictures
        self._send, self._control = send, control
        self._changed = threading.Condition()
        self._view: View | None = None
        self._moment: _Moment | None = None
        self._drawn: object = None
        self._sent = self._seen = 0
        self._key = self._closed = False
        self._spare: list[Any] = []  # copies of simulator data that can be reused
        self._renderers: dict[int, Renderer] = {}
        self._thread = threading.Thread(target=self._run, name="drawing", daemon=True)
        self._thread.start()

    def set_view(self, view: View) -> None:
        """Draw frames for a new connection, starting with a key frame."""
        with self._changed:
            self._view, self._key, self._drawn = view, True, None
            if view.codec == "none":
                self._drop(self._moment)
                self._moment = None
            self._sent = self._seen = 0
            self._changed.notify()

    def note_seen(self, frame: int) -> None:
        with self._changed:
            self._seen = max(self._seen, min(frame, self._sent))
            self._changed.notify()

    @property
    def hidden(self) -> bool:
        return self._control.state.phase is not RUNNING

    def draw(self, world: World, state: HudState, step: int, number: int, hidden: bool) -> None:
        """Queue a state for drawing. It replaces a queued state that has not been drawn yet."""
        if self._view is None or self._view.codec == "none":
            return
        with self._changed:
            self._drop(self._moment)
            data = world.copy_data(self._spare.pop() if self._spare else None)
            self._moment = _Moment(data, state.markers, step, number, hidden)
            self._changed.notify()

    def close(self) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join()

    def _run(self) -> None:
        try:
            self._draw_all()
        except Exception as error:  # a session cannot continue without frames
            self._control.apply(Trigger.FAIL, describe(error))
        for renderer in self._renderers.values():
            renderer.close()

    def _draw_all(self) -> None:
        size = FrameSize()
        shown_to: View | None = None
        encoder: Encoder = JpegEncoder()
        encoded_for: tuple[View, int] | None = None
        while (job := self._next()) is not None:
            began = time.perf_counter()
            size.limit(job.view.width, job.view.height)
            if encoded_for != (job.view, size.index):
                encoder = H264Encoder(*SIZES[size.index]) if job.view.codec == "h264" else JpegEncoder()
                encoded_for = (job.view, size.index)
                job = job._replace(key=True)
            if job.view is not shown_to:
                self._send(self.pictures())
                shown_to = job.view
            image = self._renderer(size.index).rgb(job.moment.data, markers=job.moment.markers)
            if job.moment.hidden:
                image[:] = 0
            data, is_key = encoder.encode(image, key=job.key)
            took = time.perf_counter() - began
            self._send_frame(job, SIZES[size.index], data, is_key, took)
            size.note(took, job.waited)
            time.sleep(pause_after(took))

    def _send_frame(self, job: _Job, size: tuple[int, int], data: bytes, key: bool, took: float) -> None:
        with self._changed:
            self._drop(job.moment)
            if self._view is not job.view:
                return
            self._sent += 1
            number = self._sent
        step, count = job.moment.step, job.moment.input
        self._send(
            FrameMessage(number, step, count, job.view.codec, key, *size, round(1000.0 * took, 2), data)
        )

    def _drop(self, moment: _Moment | None) -> None:
        if moment is not None:
            self._spare.append(moment.data)

    def _next(self) -> _Job | None:
        """Wait for a new state and for the browser to catch up. Return None after `close` is called."""
        ready: float | None = None  # time at which a state began to wait for the connection
        with self._changed:
            while not self._closed:
                moment, view = self._moment, self._view
                if moment is None or view is None:
                    self._changed.wait()
                elif (content := moment.content()) == self._drawn:
                    self._moment = None
                    self._drop(moment)
                elif self._sent - self._seen >= MAX_IN_FLIGHT:
                    ready = ready or time.perf_counter()
                    self._changed.wait()
                else:
                    self._moment, self._drawn, key, self._key = None, content, self._key, False
                    waited = 0.0 if ready is None else time.perf_counter() - ready
                    return _Job(moment, view, key, waited)
        return None

    def _renderer(self, size: int) -> Renderer:
        if size not in self._renderers:
            width, height = SIZES[size]
            profile = FAST if size else COARSE
            self._renderers[size] = Renderer(self._scene.model, width=width, height=height, profile=profile)
        return self._renderers[size]
