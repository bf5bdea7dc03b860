"""A session viewer that sends the HUD and either frames or snapshots to a browser."""

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np

from experiments.session.session import Viewer
from experiments.web.controls import act
from experiments.web.protocol import View
from experiments.web.state import Busy, Hud, Markers, Moment, Reach, WireMessage
from experiments.web.worker.clock import Send
from experiments.web.worker.drawing import Drawer
from experiments.web.worker.live_session import LiveSession
from experiments.web.worker.snapshots import SnapshotStream, field_of_view, scene_of
from hud.projection import CameraView, project
from hud.state import HudState
from mjsim.house.scene.avatar import eye_position
from mjsim.house.sight.sight import FieldOfView, visible_objects
from mjsim.values.actions import Pick
from mjsim.values.observation import ObjectStatus, Observation
from mjsim.values.person_parameters import PICTURE_ASPECT
from mjsim.world.world import World

HUD_EVERY = 4  # control steps between HUD updates for clients that draw the view
HEIGHT = 480  # assumed height of the picture for projecting points, in pixels


class BrowserViewer(Viewer):
    """A viewer that sends all changes to the page. `live` and `drawer` are None if no session is open."""

    def __init__(self, send: Send) -> None:
        self._send = send
        self.live: LiveSession | None = None
        self.drawer: Drawer | None = None
        self.view: View | None = None
        self._shown: tuple[HudState, bool] | None = None
        self._shown_to: tuple[View, LiveSession] | None = None
        self._sent: dict[type[WireMessage], WireMessage] = {}
        self._snapshots: SnapshotStream | None = None
        self._step = -1  # control step of the last snapshot
        self._looked = -HUD_EVERY  # control step of the last HUD update
        self._glance: object = None  # state at the last HUD update
        self._noticed: set[str] = set()  # objects that the participant has seen so far

    def set_view(self, view: View | None) -> None:
        """Send the complete state to a new connection. If `view` is None, keep the previous view."""
        self.view = view or self.view
        if self.drawer is not None and self.view is not None:
            self.drawer.set_view(self.view)

    def camera(self, world: World) -> CameraView | None:
        """Return the eye camera with the view's aspect ratio. Arrows that point to objects outside the view need it."""
        view = self.view
        if view is None:
            return None
        aspect = view.width / view.height if view.codec == "none" else PICTURE_ASPECT
        person, (x, y, heading, pitch) = world.scene.person, world.body[:4].tolist()
        eye = np.array(eye_position(x, y, heading, pitch, person.eye_height))
        c, s, cp, sp = math.cos(heading), math.sin(heading), math.cos(pitch), math.sin(pitch)
        rotation = np.array([[s, -c * sp, -c * cp], [-c, -s * sp, -s * cp], [0.0, cp, -sp]])
        angle = person.field_of_view if self.live is None else field_of_view(self.live, view)
        fovy = 2.0 * math.atan(math.tan(angle / 2.0) / aspect)
        return CameraView(eye, rotation, fovy, max(1, round(HEIGHT * aspect)), HEIGHT)

    def look(self) -> None:
        """Show the current state. Clients that draw the view receive the HUD less often."""
        live = self.live
        if live is None:
            return
        seen, step = live.session.observation, live.session.record.step
        glance = seen.object_status, seen.hands, seen.busy, self._hidden
        anew = self._shown_to is None or self._shown_to[0] is not self.view
        if self._snapshots is None or anew or glance != self._glance or step - self._looked >= HUD_EVERY:
            self._glance, self._looked = glance, step
            live.session.show()
        elif not self._hidden:
            self._send_snapshot(self._snapshots, seen, step)

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None:
        """Send everything that has changed since the last call."""
        view, live = self.view, self.live
        if live is None or self.drawer is None or view is None:
            return
        if self._shown_to is None or self._shown_to[0] is not view or self._shown_to[1] is not live:
            self._begin(view, live)
        hidden = self.drawer.hidden
        if self._shown is not None and self._shown[0] is hud_state and self._shown[1] is hidden:
            return
        self._shown = hud_state, hidden
        step = live.session.record.step
        self.drawer.draw(world, hud_state, step, live.input, hidden)
        if hidden:
            return
        if self._snapshots is not None:
            self._send_snapshot(self._snapshots, observation, step)
        for message in self._beside(live, observation, hud_state, step):
            content = msgspec.structs.replace(message, step=0) if isinstance(message, Moment) else message
            if self._sent.get(type(message)) != content:
                self._sent[type(message)] = content
                self._send(message)

    @property
    def _hidden(self) -> bool:
        return self.drawer is None or self.drawer.hidden

    def _send_snapshot(self, snapshots: SnapshotStream, seen: Observation, step: int) -> None:
        if step != self._step:
            self._step = step
            self._send(snapshots.next(seen, step))

    def _begin(self, view: View, live: LiveSession) -> None:
        if self._shown_to is None or self._shown_to[1] is not live:
            self._noticed.clear()
        self._shown_to, self._shown, self._step, self._snapshots = (view, live), None, -1, None
        self._sent.clear()
        if view.codec == "none":
            self._snapshots = SnapshotStream(live, view)
            self._send(scene_of(live, view))
            if self.drawer is not None:
                self._send(self.drawer.pictures())

    def _beside(
        self, live: LiveSession, seen: Observation, state: HudState, step: int
    ) -> Iterator[WireMessage]:
        yield page_hud(state)
        yield self._moment(live, seen, state, step)
        yield Busy(seen.busy) if self._snapshots is None else Markers(state.markers)

    def _moment(self, live: LiveSession, seen: Observation, state: HudState, step: int) -> Moment:
        rooms = live.shown.rooms
        clock = None if state.clock is None else float(math.floor(state.clock))
        room = rooms.label(rooms.room_at(seen.position))
        return Moment(
            step, clock, room, self._reach(live, seen, bool(state.markers)), state.pointer, state.minimap
        )

    def _reach(self, live: LiveSession, seen: Observation, marked: bool) -> Reach | None:
        """Return the target of the action key. `marked` is True if markers show where objects are."""
        if (camera := self.camera(live.world)) is None:
            return None
        self._notice(live, seen, camera)
        result = live.world.answer(act(live.world.answer))
        if not result.applied or result.object is None:
            return None
        catalogue, episode = live.shown.catalogue, live.scene.episode
        model = next(item.model for item in episode.objects if item.name == result.object)
        place: Any
        if isinstance(result.action, Pick):
            if not marked and result.object not in self._noticed:
                return None
            receptacle, place = None, seen.object_positions[seen.object_names.index(result.object)]
        else:
            key = episode.targets[result.object]
            receptacle, place = catalogue.receptacles[key].label, live.house.receptacles[key].center
        ((x, y),), (depth,) = project(camera, [place])
        at = (round(float(x) / camera.width, 4), round(float(y) / camera.height, 4))
        in_view = depth > 0.0 and all(0.0 <= share <= 1.0 for share in at)
        label, (px, py, pz) = catalogue.objects[model].label, np.round(place, 4).tolist()
        return Reach(label, receptacle, at if in_view else None, result.object, (px, py, pz))

    def _notice(self, live: LiveSession, seen: Observation, camera: CameraView) -> None:
        """Remember the objects that are in the picture now."""
        loose = set(seen.names_with(ObjectStatus.LOOSE)) - self._noticed
        if loose:
            horizontal = 2.0 * math.atan(math.tan(camera.fovy / 2.0) * camera.width / camera.height)
            field = FieldOfView(horizontal, camera.fovy, live.scene.person.viewing_distance)
            pose = seen.eye, seen.heading, seen.pitch
            self._noticed.update(
                visible_objects(live.scene, live.world.data, *pose, field=field, among=loose)
            )


def page_hud(state: HudState) -> Hud:
    """Return the state of the HUD without markers and without what `Moment` messages contain."""
    message = state.message
    if message is not None:
        message = dataclasses.replace(message, opacity=1.0) if message.opacity > 0.0 else None
    return Hud(
        dataclasses.replace(state, markers=(), message=message, clock=None, pointer=None, minimap=None)
    )
