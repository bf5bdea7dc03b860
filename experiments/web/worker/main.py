"""The main loop of a worker process. It runs one session at a time and exits when the server closes."""

import os
import socket
import threading
from contextlib import closing, suppress
from functools import partial
from pathlib import Path
from queue import SimpleQueue

import msgspec

from experiments.errors import describe
from experiments.house import House
from experiments.record.phases import INTERRUPTED
from experiments.record.run_directory import is_run
from experiments.trials.trial_config import TrialConfig
from experiments.web import protocol
from experiments.web.state import Trigger, WireMessage
from experiments.web.worker import houses
from experiments.web.worker.clock import Clock
from experiments.web.worker.control import SessionControl
from experiments.web.worker.drawing import Drawer
from experiments.web.worker.live_session import (
    LiveSession,
    is_over,
    open_journal,
    remove_journal,
    save_run,
)
from experiments.web.worker.viewer import BrowserViewer
from hud.texts import HudTexts


class Worker:
    """A worker that runs the sessions opened by the server, one at a time."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._sending = threading.Lock()
        self._opened: SimpleQueue[tuple[protocol.Open, SessionControl]] = SimpleQueue()
        self._viewer = BrowserViewer(self._send)
        self._control = SessionControl(self._send)

    def run(self) -> None:
        threading.Thread(target=self._receive, name="receiving", daemon=True).start()
        while True:
            opened, control = self._opened.get()
            try:
                self._serve(opened, control)
            except Exception as error:  # the server reports the failure, and the journal is kept
                control.apply(Trigger.FAIL, describe(error))

    def _send(self, message: WireMessage) -> None:
        with self._sending, suppress(OSError):  # the receiving thread handles a closed connection
            self._connection.sendall(protocol.packed(message))

    def _receive(self) -> None:
        """Handle messages until the server closes, then exit immediately. The journal stays on disk."""
        with suppress(OSError), self._connection.makefile("rb") as stream:
            while len(head := stream.read(protocol.LENGTH.size)) == protocol.LENGTH.size:
                (length,) = protocol.LENGTH.unpack(head)
                if len(content := stream.read(length)) < length:
                    break
                self._take(protocol.decode_to_worker(content))
        os._exit(0)

    def _take(self, message: WireMessage) -> None:
        # The server itself can also send these messages.
        if not isinstance(message, protocol.Open | protocol.Pause):
            self._control.hear()
        match message:
            case protocol.Open():
                self._control = SessionControl(self._send)
                self._opened.put((message, self._control))
            case protocol.Inputs(inputs, until):
                self._control.add(inputs, until)
            case protocol.RunMessage(until):
                self._control.apply(Trigger.RUN, until=until)
            case protocol.Pause(reason):
                self._control.apply(Trigger.PAUSE, reason)
            case protocol.Leave():
                self._control.apply(Trigger.END, INTERRUPTED)
            case protocol.Blur(away):
                self._control.note("blur", away=away)
            case protocol.Display() | protocol.Draw():
                self._control.note(type(message).__name__.lower(), **msgspec.structs.asdict(message))
            case protocol.View():
                self._viewer.set_view(message)
                self._control.ask_to_show()
            case protocol.Seen(frame) if self._viewer.drawer is not None:
                self._viewer.drawer.note_seen(frame)

    def _serve(self, opened: protocol.Open, control: SessionControl) -> None:
        config = TrialConfig.of(opened.config)
        folder, run, house = Path(opened.folder), Path(opened.run), houses.house(config.house)
        if not is_run(run):
            self._play(opened, control, config, house)
        shown = house.in_language(opened.language, _texts(opened))
        save_run(folder, run, shown, floor_plan=opened.floor_plan)
        remove_journal(folder, run)
        control.apply(Trigger.END)
        self._send(protocol.Saved())

    def _play(
        self, opened: protocol.Open, control: SessionControl, config: TrialConfig, house: House
    ) -> None:
        viewer = self._viewer
        with open_journal(Path(opened.folder)) as journal:
            if not (is_over(journal) or is_run(Path(opened.run))):  # another worker may have finished the run
                live = LiveSession(
                    journal,
                    house,
                    config,
                    viewer,
                    before=opened.before,
                    language=opened.language,
                    texts=_texts(opened),
                )
                pictures = partial(
                    houses.shown_pictures, config, live.shown, explained=opened.explains_markers
                )
                with closing(Drawer(live.scene, pictures, self._send, control)) as drawer:
                    viewer.live, viewer.drawer = live, drawer
                    viewer.set_view(None)
                    if live.resumed:
                        reason = "restarted" if opened.restarted else "disconnected"
                        self._send(protocol.Taken(live.input, live.session.record.step))
                        control.apply(Trigger.RESTORED, reason, last=live.input)
                    else:
                        control.apply(Trigger.OPENED)
                    sync, hurries = journal.sync, opened.as_inputs_come
                    clock = Clock(live, control, sync, self._send, viewer.look, as_inputs_come=hurries)
                    reason = clock.run()
                    viewer.live = viewer.drawer = None
                live.end(reason)


def _texts(opened: protocol.Open) -> HudTexts | None:
    return HudTexts(**opened.texts) if opened.texts else None
