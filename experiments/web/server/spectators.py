"""Spectators, who watch a participant's page during a session."""

from typing import Any, Protocol

from msgspec.structs import replace

from experiments.web.protocol import IDLE, FrameMessage
from experiments.web.state import Hud, Markers, Moment, Pictures, SceneMessage, Snapshot, State, WireMessage

# For these types, a new message replaces the previous one
KEPT = (State, SceneMessage, Pictures, Hud, Markers, Moment)


class Browser(Protocol):
    """The connection to the page of a participant or a spectator. `tab` is the name of a participant's page."""

    tab: str

    def send(self, message: WireMessage) -> None:
        """Queue a message for the page."""

    def close(self, code: int, reason: str) -> None:
        """Close the connection after sending all queued messages."""


class Spectators:
    """The spectators of a session, and the latest messages, which new spectators receive first."""

    def __init__(self) -> None:
        self._all: set[Browser] = set()
        self._last: dict[type[WireMessage], WireMessage] = {}
        self._snapshot: Snapshot | None = None  # last snapshot, extended to all objects that the page knows

    def join(self, spectator: Browser) -> None:
        """Add a spectator and send the current state."""
        self._all.add(spectator)
        for kind in KEPT:
            if kind in self._last:
                spectator.send(self._last[kind])
        if self._snapshot is not None:
            spectator.send(self._snapshot)

    def leave(self, spectator: Browser) -> None:
        self._all.discard(spectator)

    def close(self) -> None:
        """Disconnect all spectators. Their pages then reconnect automatically."""
        for spectator in self._all:
            spectator.close(IDLE, "the session has stopped")

    def tell(self, message: Any) -> None:
        """Forward a message to all spectators, and store it for new spectators."""
        match message:
            case Snapshot(gone=gone):
                before = self._snapshot or message
                known = before.objects | message.objects, before.models | message.models
                objects, models = ({k: v for k, v in one.items() if k not in gone} for one in known)
                self._snapshot = replace(message, objects=objects, models=models, gone=[])
            case SceneMessage() | FrameMessage():  # earlier snapshots are obsolete
                self._snapshot = None
        if isinstance(message, KEPT):
            self._last[type(message)] = message
        if isinstance(message, (*KEPT, Snapshot, FrameMessage)):
            for spectator in self._all:
                spectator.send(message)
