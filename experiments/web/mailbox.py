"""What the server has said and the session has not taken yet; one thread fills it, another empties it."""

import threading
import time
from dataclasses import dataclass, field

from experiments.web.controls import Input


@dataclass
class Mailbox:
    """Inputs in order, each once, and what the clock should do.

    Attributes:
        last: Number of the last input that was taken in.
        begun: Whether the clock was started.
        paused: Why the clock stands, or None.
        leave: Whether the session is to end.
        closed: Whether the server is gone.
    """

    last: int = 0
    begun: bool = False
    paused: str | None = None
    leave: bool = False
    closed: bool = False
    _inputs: list[Input] = field(default_factory=list)
    _blurs: list[tuple[bool, float]] = field(default_factory=list)
    _changed: threading.Condition = field(default_factory=threading.Condition)

    def add(self, inputs: list[Input]) -> None:
        """Take in those that are new: after a reconnection, the browser sends again what was not acknowledged."""
        with self._changed:
            for new in inputs:
                if new.number > self.last:
                    self._inputs.append(new)
                    self.last = new.number
            self._changed.notify_all()

    def set(self, **changes: object) -> None:
        """Change attributes."""
        with self._changed:
            for name, value in changes.items():
                setattr(self, name, value)
            self._changed.notify_all()

    def take(self) -> tuple[Input, ...]:
        """All inputs that came since the last call."""
        with self._changed:
            taken, self._inputs = tuple(self._inputs), []
        return taken

    def add_blur(self, away: bool) -> None:
        """The page lost the keyboard, or got it back, at this moment."""
        with self._changed:
            self._blurs.append((away, time.time()))

    def take_blurs(self) -> list[tuple[bool, float]]:
        """What `add_blur` was told since the last call, each with its time, s since 1970."""
        with self._changed:
            taken, self._blurs = self._blurs, []
        return taken

    def wait_until_running(self, seconds: float) -> bool:
        """Wait at most so long until the clock is to run or the session to end; whether it is to run."""
        with self._changed:
            self._changed.wait_for(lambda: self.runs or self.leave or self.closed, seconds)
            return self.runs

    @property
    def runs(self) -> bool:
        """Whether the clock is to run."""
        return self.begun and self.paused is None and not (self.leave or self.closed)
