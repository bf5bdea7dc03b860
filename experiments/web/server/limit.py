"""The limit of sessions at a time, and the queue for a place."""

import asyncio
from collections.abc import Callable

OnPosition = Callable[[int], None]


class SessionLimit:
    """Limits how many sessions are open at a time; others wait in order."""

    def __init__(self, count: int) -> None:
        self._free = count
        self._waiting: dict[OnPosition, asyncio.Future[None]] = {}

    @property
    def waiting(self) -> int:
        """How many sessions wait."""
        return len(self._waiting)

    def position(self, on_position: OnPosition) -> int | None:
        """Position in the queue, 1 for the next one; None for a session that does not wait."""
        return list(self._waiting).index(on_position) + 1 if on_position in self._waiting else None

    async def acquire(self, on_position: OnPosition) -> None:
        """Wait for a place; `on_position` is called whenever the position in the queue changes."""
        if self._free and not self._waiting:
            self._free -= 1
            return
        turn = self._waiting[on_position] = asyncio.get_running_loop().create_future()
        on_position(len(self._waiting))
        try:
            await turn
        except asyncio.CancelledError:
            if self._waiting.pop(on_position, None) is not None:
                self._announce()
            elif not turn.cancelled():
                self.release()
            raise

    def release(self) -> None:
        """Give the place to the session that has waited longest."""
        while self._waiting:
            turn = self._waiting.pop(next(iter(self._waiting)))
            if not turn.done():  # else it was cancelled just now
                turn.set_result(None)
                self._announce()
                return
        self._free += 1

    def _announce(self) -> None:
        for position, on_position in enumerate(self._waiting, start=1):
            on_position(position)
