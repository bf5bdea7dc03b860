"""Watches a session for the browser: frames, snapshots, and the HUD as text."""

from experiments.session.viewer import Viewer
from experiments.web.protocol import Busy, Snapshot, Text, View, WireMessage
from experiments.web.worker.clock import Send
from experiments.web.worker.drawing import Drawer
from experiments.web.worker.live_session import LiveSession
from hud.projection import CameraView
from hud.state import HudState
from mjsim.observation import Observation
from mjsim.world import World


class BrowserViewer(Viewer):
    """Sends the changes of each control step. `live` and `drawer` are None while no session is open."""

    def __init__(self, send: Send) -> None:
        self._send = send
        self.live: LiveSession | None = None
        self.drawer: Drawer | None = None
        self.view: View | None = None
        self._shown: HudState | None = None
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
        if hud_state is self._shown:
            return
        self._shown = hud_state
        step, number = self.live.session.record.step, self.live.input
        self.drawer.draw(world, hud_state, step, number)
        if view.snapshots:
            self._send(_snapshot(observation, hud_state, step, number))
        for message in (_text(hud_state), Busy(observation.busy)):
            if self._sent.get(type(message)) != message:
                self._sent[type(message)] = message
                self._send(message)


def _snapshot(seen: Observation, state: HudState, step: int, number: int) -> Snapshot:
    poses = zip(
        seen.object_names, seen.object_positions.tolist(), seen.object_quaternions.tolist(), strict=True
    )
    return Snapshot(
        step,
        number,
        seen.time,
        [*map(float, seen.eye), seen.heading, seen.pitch],
        {name: [*position, *quaternion] for name, position, quaternion in poses},
        state,
    )


def _text(state: HudState) -> Text:
    rows = [
        " ".join(f"{'Done: ' if item.done else ''}{item.text}. {item.detail}".split())
        for item in state.checklist
    ]
    return Text(
        message="" if state.message is None else state.message.text,
        title=state.checklist_title,
        rows=rows,
        hands=[slot.label or "empty" for slot in state.inventory if slot is not None],
    )
