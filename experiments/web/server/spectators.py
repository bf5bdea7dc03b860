"""Spectators, who watch a participant's page during a session."""

from typing import Any, Protocol

import msgspec

from experiments.web.protocol import IDLE, FrameMessage
from experiments.web.state import Hud, Markers, Moment, Pictures, SceneMessage, Snapshot, State, WireMessage

KEPT = (
    State,
    SceneMessage,
    Pictures,
    Hud,
    Markers,
    Moment,
)  # for these types, a new message replaces the previous one


class Spectator(Protocol):
    """The connection to a spectator's page."""

    def send(self, message: WireMessage) -> None:
        """Queue a message for the page."""

    def close(self, code: int, reason: str) -> None:
        """Close the connection after sending all queued messages."""


class Spectators:
    """The spectators of a session, and the latest messages, which new spectators receive first."""

    def __init__(self) -> None:
        self._all: set[Spectator] = set()
        self._last: dict[type[WireMessage], WireMessage] = {}
        self._snapshot: Snapshot | None = None
        self._objects: dict[str, list[float]] = {}
        self._models: dict[str, str] = {}

    def join(self, spectator: Spectator) -> None:
        """Add a spectator and send the current state."""
        self._all.add(spectator)
        for kind in KEPT:
            if kind in self._last:
                spectator.send(self._last[kind])
        if self._snapshot is not None:
            spectator.send(
                msgspec.structs.replace(
                    self._snapshot, objects=dict(self._objects), models=dict(self._models), gone=[]
                )
            )

    def leave(self, spectator: Spectator) -> None:
        self._all.discard(spectator)

    def close(self) -> None:
        """Disconnect all spectators. Their pages then reconnect automatically."""
        for spectator in self._all:
            spectator.close(IDLE, "the session has stopped")

    def tell(self, message: Any) -> None:
        """Forward a message to all spectators, and store it for new spectators."""
        match message:
            case Snapshot(objects=objects, models=models, gone=gone):
                self._snapshot = message
                self._objects |= objects
                self._models |= models
                for name in gone:
                    self._objects.pop(name, None)
                    self._models.pop(name, None)
            case SceneMessage() | FrameMessage():  # earlier snapshots are obsolete
                self._snapshot = None
                self._objects, self._models = {}, {}
        if isinstance(message, KEPT):
            self._last[type(message)] = message
        if isinstance(message, (*KEPT, Snapshot, FrameMessage)):
            for spectator in self._all:
                spectator.send(message)
