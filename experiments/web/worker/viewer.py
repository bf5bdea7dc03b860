"""Watches a session for the browser: frames, snapshots, and the HUD beside the frames."""

import dataclasses
import math

import msgspec

from experiments.session.viewer import Viewer
from experiments.web.controls import act
from experiments.web.protocol import Busy, Hud, Moment, Reach, Snapshot, View, WireMessage
from experiments.web.worker.clock import Send
from experiments.web.worker.drawing import Drawer
from experiments.web.worker.live_session import LiveSession
from hud.projection import CameraView, project
from hud.state import HudState
from mjsim.actions import Pick
from mjsim.model.sight import visible_objects
from mjsim.observation import Observation
from mjsim.world import World


class BrowserViewer(Viewer):
    """Sends the changes of each control step. `live` and `drawer` are None while no session is open."""

    def __init__(self, send: Send) -> None:
        self._send = send
        self.live: LiveSession | None = None
        self.drawer: Drawer | None = None
        self.view: View | None = None
        self._shown: tuple[HudState, bool] | None = None
        self._shown_to: View | None = None
        self._sent: dict[type[WireMessage], WireMessage] = {}

    def set_view(self, view: View | None) -> None:
        """Show everything anew, to a browser that has just connected; None repeats the view before."""
        self.view = view or self.view
        if self.drawer is not None and self.view is not None:
            self.drawer.set_view(self.view)

    def camera(self, world: World) -> CameraView | None:
        """The eye camera, for a pointer to targets out of view."""
        return None if self.drawer is None else self.drawer.camera_view(world.data)

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None:
        """Send what changed; a session shows every state twice, before a control step and after the one before."""
        view = self.view
        if self.live is None or self.drawer is None or view is None:
            return
        if view is not self._shown_to:
            self._shown_to, self._shown = view, None
            self._sent.clear()
        hidden = self.drawer.hidden
        if self._shown is not None and self._shown[0] is hud_state and self._shown[1] is hidden:
            return
        self._shown = hud_state, hidden
        step, number = self.live.session.record.step, self.live.input
        self.drawer.draw(world, hud_state, step, number, hidden)
        if hidden:
            return
        if view.snapshots:
            self._send(_snapshot(world, observation, hud_state, step, number))
        for message in (
            _hud(hud_state),
            self._moment(self.live, observation, hud_state, step),
            Busy(observation.busy),
        ):
            content = msgspec.structs.replace(message, step=0) if isinstance(message, Moment) else message
            if self._sent.get(type(message)) != content:
                self._sent[type(message)] = content
                self._send(message)

    def _moment(self, live: LiveSession, seen: Observation, state: HudState, step: int) -> Moment:
        rooms = live.house.rooms
        clock = None if state.clock is None else float(math.floor(state.clock))
        room = rooms.label(rooms.room_at(seen.position))
        return Moment(step, clock, room, self._reach(live, seen), state.pointer, state.minimap)

    def _reach(self, live: LiveSession, seen: Observation) -> Reach | None:
        """What the action key would do now."""
        result = live.world.answer(act(live.world.answer))
        camera = self.camera(live.world)
        if not result.applied or result.object is None or camera is None:
            return None
        catalogue, episode = live.house.catalogue, live.scene.episode
        model = next(item.model for item in episode.objects if item.name == result.object)
        if isinstance(result.action, Pick):
            receptacle, place = None, seen.object_positions[seen.object_names.index(result.object)]
        else:
            key = episode.targets[result.object]
            receptacle, place = catalogue.receptacles[key].label, live.house.receptacles[key].center
        ((x, y),), (depth,) = project(camera, [place])
        at = (round(float(x) / camera.width, 4), round(float(y) / camera.height, 4))
        in_view = depth > 0.0 and all(0.0 <= share <= 1.0 for share in at)
        return Reach(catalogue.objects[model].label, receptacle, at if in_view else None)


def _snapshot(world: World, seen: Observation, state: HudState, step: int, number: int) -> Snapshot:
    """What the person sees; objects that are neither in view nor in hand are left out."""
    poses = zip(
        seen.object_names, seen.object_positions.tolist(), seen.object_quaternions.tolist(), strict=True
    )
    in_view = visible_objects(world.scene, world.data, seen.eye, seen.heading, seen.pitch)
    shown = {*in_view, *seen.carried}
    return Snapshot(
        step,
        number,
        seen.time,
        [*map(float, seen.eye), seen.heading, seen.pitch],
        {name: [*position, *quaternion] for name, position, quaternion in poses if name in shown},
        state,
    )


def _hud(state: HudState) -> Hud:
    message = state.message
    if message is not None:
        message = dataclasses.replace(message, opacity=1.0) if message.opacity > 0.0 else None
    return Hud(
        dataclasses.replace(state, markers=(), message=message, clock=None, pointer=None, minimap=None)
    )
