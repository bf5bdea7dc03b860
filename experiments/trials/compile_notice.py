"""Reports once that kernels are being compiled: a first command that takes a minute does not hang."""

import contextlib
import sys
from collections.abc import Callable

from numba.core import event

NOTICE = "compiling numeric code, once after an installation or update; this takes about a minute"


class _Notice(event.Listener):  # type: ignore[misc]  # numba has no types
    """Prints when the first kernel is compiled that is not on disk."""

    def __init__(self, may_speak: Callable[[], bool]) -> None:
        self._may_speak = may_speak
        self._heard = False

    def on_start(self, event: object) -> None:  # noqa: ARG002 - every event says the same
        first, self._heard = not self._heard, True
        if first and sys.stderr is not None and self._may_speak():
            with contextlib.suppress(OSError):  # standard error is closed
                sys.stderr.write(f"mjsim: {NOTICE}\n")
                sys.stderr.flush()

    def on_end(self, event: object) -> None:
        """Nothing: only the first beginning counts."""


def announce_compiling(may_speak: Callable[[], bool] = lambda: True) -> None:
    """From now on, say on standard error when the first kernel is compiled, if `may_speak` then agrees."""
    event.register("numba:compile", _Notice(may_speak))
