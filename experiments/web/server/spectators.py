"""Those who watch a session: they see what its page sees, from the moment they come, and can do nothing."""

from typing import Any, Protocol

import msgspec

from experiments.web.protocol import (
    IDLE,
    Frame,
    Hud,
    Markers,
    Moment,
    Pictures,
    Scene,
    Snapshot,
    State,
    WireMessage,
)

KEPT = (State, Scene, Pictures, Hud, Markers, Moment)  # kinds of which the last message says all


class Spectator(Protocol):
    """A connection to a page that only looks."""

    def send(self, message: WireMessage) -> None:
        """Send a message, without waiting."""

    def close(self, code: int, reason: str) -> None:
        """Close the connection once all is sent."""


class Spectators:
    """The spectators of a session, and what one who comes later has to be told first."""

    def __init__(self) -> None:
        self._all: set[Spectator] = set()
        self._last: dict[type[WireMessage], WireMessage] = {}
        self._snapshot: Snapshot | None = None
        self._objects: dict[str, list[float]] = {}
        self._models: dict[str, str] = {}

    def join(self, spectator: Spectator) -> None:
        """Tell somebody the present state, and from now on all that happens."""
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
        """The session stops; its page, and those who watch, may come back."""
        for spectator in self._all:
            spectator.close(IDLE, "the session has stopped")

    def tell(self, message: Any) -> None:
        """Take a message that the session's page is sent."""
        match message:
            case Snapshot(objects=objects, models=models, gone=gone):
                self._snapshot = message
                self._objects |= objects
                self._models |= models
                for name in gone:
                    self._objects.pop(name, None)
                    self._models.pop(name, None)
            case Scene() | Frame():  # all that may be known comes anew, or is in a picture
                self._snapshot = None
                self._objects, self._models = {}, {}
        if isinstance(message, KEPT):
            self._last[type(message)] = message
        if isinstance(message, (*KEPT, Snapshot, Frame)):
            for spectator in self._all:
                spectator.send(message)
