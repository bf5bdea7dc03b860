"""A worker process: one world, one session at a time, its clock, and its journal.

It is forked with house and kernels loaded (`forkserver.py`). A server that dies leaves its worker behind: the clock
stands, and the worker waits in the session's folder for the next server (`rejoining.py`). Without a session it exits;
the journal holds everything that was acknowledged.
"""

import os
import socket
import threading
from functools import partial
from pathlib import Path
from typing import Any

import msgspec

from experiments.house import House
from experiments.runs import records
from experiments.runs.run_directory import is_run
from experiments.session.user_code import describe
from experiments.session.viewer import Viewer
from experiments.trials.trial_config import TrialConfig
from experiments.web import messages
from experiments.web.clock import Clock
from experiments.web.connection import Connection
from experiments.web.drawing import Drawer
from experiments.web.encoders import Image
from experiments.web.journalled_run import save_run
from experiments.web.live_session import LiveSession, config_of, is_over, open_journal
from experiments.web.mailbox import Mailbox
from experiments.web.rejoining import let_go_of_stderr, wait_for_server
from hud.projection import CameraView
from hud.state import HudState
from mjsim.observation import Observation
from mjsim.render import render_pictures
from mjsim.world import World

DISCONNECTED = "disconnected"  # why the clock stands without a server


class Window(Viewer):
    """Looks at the session before every control step: frames for the drawing thread, states, texts."""

    def __init__(self, connection: Connection, drawer: "Drawer | None" = None) -> None:
        self._connection = connection
        self.drawer = drawer
        self.live: LiveSession | None = None
        self.states = False
        self._shown: HudState | None = None
        self._text: messages.Text | None = None
        self._busy: bool | None = None
        self._browsers = self._told = 0  # that have connected, and that were told everything

    def camera(self, world: World) -> CameraView | None:
        """The eye camera, for a pointer to what is out of view."""
        return None if self.drawer is None else self.drawer.camera_view(world.data)

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None:
        """Hand on what changed; a session shows every state twice, before a control step and after the one before."""
        browsers = self._browsers
        if self.live is None or self.drawer is None:
            return
        if browsers != self._told:
            self._told, self._shown, self._text, self._busy = browsers, None, None, None
        if hud_state is self._shown:
            return
        self._shown = hud_state
        step, number = self.live.session.recording.step, self.live.input
        self.drawer.offer(world, hud_state, step, number)
        if self.states:
            self._connection.send(_state(observation, hud_state, step, number))
        text = _text(hud_state)
        if text != self._text:
            self._text = text
            self._connection.send(text)
        if observation.busy != self._busy:
            self._busy = observation.busy
            self._connection.send(messages.Busy(observation.busy))

    def repeat(self) -> None:
        """Say everything again, to a browser that has just connected."""
        self._browsers += 1


class Worker:
    """Runs one session after the other.

    Args:
        link: Socket to the server.
        name: Of the house that is played in.
        house: That house.
        pictures: What `render_pictures` made of it; none where that is still to be done.
    """

    def __init__(self, link: socket.socket, name: str, house: House, pictures: dict[str, Image]) -> None:
        self._connection = Connection(link)
        self._mailbox = Mailbox()
        self._opened: list[messages.Open] = []
        self._serving: messages.Open | None = None
        self._arrived = threading.Condition()
        self._window = Window(self._connection)
        self._view: messages.View | None = None
        self._houses = {name: house}
        self._pictures = {id(house): pictures} if pictures else {}

    def run(self) -> None:
        """Serve until the server is gone, and no other one asks for the session."""
        self._connection.send(messages.Started(os.getpid()))
        threading.Thread(target=self._receive, name="receiving", daemon=True).start()
        while (opened := self._next_session()) is not None:
            try:
                self._serve(opened)
            except Exception as error:  # the server tells the person, and keeps the journal
                self._connection.send(messages.Failed(describe(error)))
            with self._arrived:
                self._serving = None

    def _next_session(self) -> messages.Open | None:
        with self._arrived:
            self._arrived.wait_for(lambda: self._opened or self._mailbox.closed)
            if not self._opened:
                return None
            self._serving = opened = self._opened.pop(0)
            self._mailbox = Mailbox(closed=self._mailbox.closed, paused=opened.paused)
            return opened

    def _receive(self) -> None:
        while self._receive_from_server() and self._rejoined():
            pass
        with self._arrived:
            self._mailbox.set(closed=True)
            self._arrived.notify()

    def _receive_from_server(self) -> bool:
        """Take what the server says until it is gone; False if it said to exit."""
        for message in self._connection.receive():
            if isinstance(message, messages.Exit):
                return False
            self._take(message)
        return True

    def _rejoined(self) -> bool:
        """Let the clock stand, and wait for another server; False if there is no session, or no server came."""
        with self._arrived:
            opened = self._serving
            if opened is None:
                return False
            self._mailbox.set(paused=self._mailbox.paused or DISCONNECTED)
        let_go_of_stderr()
        link = wait_for_server(Path(opened.folder), lambda: self._serving is not None)
        if link is None:
            return False
        self._connection.replace(link)
        self._connection.send(messages.Started(os.getpid()))
        return True

    def _open(self, message: messages.Open) -> None:
        """Begin with a session in its turn, or go on with the one that is open already."""
        with self._arrived:
            serving = self._serving is not None and self._serving.folder == message.folder
            if serving:
                self._mailbox.set(paused=message.paused)
            else:
                self._opened.append(message)
                self._arrived.notify()
            if serving and self._window.live is not None:
                self._say_ready(self._window.live)

    def _say_ready(self, live: LiveSession) -> None:
        mailbox = self._mailbox
        self._connection.send(
            messages.Ready(live.session.recording.step, mailbox.last, live.resumed, mailbox.begun)
        )

    def _take(self, message: Any) -> None:
        if isinstance(message, messages.Open):
            self._open(message)
        elif isinstance(message, messages.Inputs):
            self._mailbox.add(message.inputs)
        elif isinstance(message, messages.Begin):
            self._mailbox.set(begun=True)
        elif isinstance(message, messages.Pause):
            self._mailbox.set(paused=message.reason)
        elif isinstance(message, messages.Resume):
            self._mailbox.set(paused=None)
        elif isinstance(message, messages.Blur):
            self._mailbox.add_blur(message.away)
        elif isinstance(message, messages.Leave):
            self._mailbox.set(leave=True)
        elif isinstance(message, messages.View):
            self._view = message
            self._apply_view()
        elif self._window.drawer is not None:
            self._window.drawer.seen(message.frame)

    def _apply_view(self) -> None:
        if self._view is not None and self._window.drawer is not None:
            self._window.states = self._view.state
            self._window.drawer.show_to(self._view)
            self._window.repeat()

    def _serve(self, opened: messages.Open) -> None:
        folder = Path(opened.folder)
        config = None if opened.config is None else config_of(opened.config)
        house = self._house() if config is None else self._house(config.house)
        with open_journal(folder) as journal:
            if is_over(journal.records):
                self._finish(folder, Path(opened.run), house)
                return
            live = LiveSession(journal, house, config, self._window, before=opened.before)
            mailbox = self._mailbox
            pictures = partial(self._pictures_of, house)
            with Drawer(live.scene, live.house, pictures, self._connection.send) as drawer:
                self._window.live, self._window.drawer = live, drawer
                mailbox.set(last=live.input, begun=mailbox.begun or live.resumed)
                self._say_ready(live)
                self._apply_view()
                reason = Clock(live, mailbox, journal.sync, self._connection).run()
                self._window.live = self._window.drawer = None
            if reason is None:
                live.close()
                return
            live.end(reason)
        self._finish(folder, Path(opened.run), house)

    def _house(self, name: str = TrialConfig.house) -> House:
        """A house; loaded once."""
        if name not in self._houses:
            self._houses[name] = House.load(name)
        return self._houses[name]

    def _pictures_of(self, house: House) -> dict[str, Image]:
        """Pictures of a house's objects and receptacles; made once."""
        if id(house) not in self._pictures:
            self._pictures[id(house)] = render_pictures(house.catalogue)
        return self._pictures[id(house)]

    def _finish(self, folder: Path, run: Path, house: House) -> None:
        """Make the run directory of a session that is over, or what of it a kill prevented."""
        if not (is_run(run) and (run / records.TOPDOWN).is_file()):
            save_run(folder, run, house)
        metrics = msgspec.json.decode((run / records.METRICS).read_bytes())
        self._connection.send(messages.Over(metrics["ended"], metrics))


def _state(seen: Observation, state: HudState, step: int, number: int) -> messages.State:
    poses = zip(
        seen.object_names, seen.object_positions.tolist(), seen.object_quaternions.tolist(), strict=True
    )
    return messages.State(
        step,
        number,
        seen.time,
        [*map(float, seen.eye), seen.heading, seen.pitch],
        {name: [*position, *quaternion] for name, position, quaternion in poses},
        state,
    )


def _text(state: HudState) -> messages.Text:
    rows = [
        " ".join(f"{'Done: ' if item.done else ''}{item.text}. {item.detail}".split())
        for item in state.checklist
    ]
    return messages.Text(
        message="" if state.message is None else state.message.text,
        title=state.checklist_title,
        rows=rows,
        hands=[slot.label or "empty" for slot in state.inventory if slot is not None],
    )
