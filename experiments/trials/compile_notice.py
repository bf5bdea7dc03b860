"""A notice that kernels are being compiled, so that a first command of a minute does not seem to hang."""

import contextlib
import sys
from collections.abc import Callable
from pathlib import Path

from numba.core.event import Event, Listener, register

from mjsim.support.kernels import cache_base, cache_folder

NOTICE = "compiling numeric code that no command has used since the last update; this takes up to a minute"
NOT_KEPT = (
    "compiling numeric code, which takes up to a minute at every command because {folder} is not writable; "
    "set NUMBA_CACHE_DIR to a folder that is"
)


class _Notice(Listener):  # type: ignore[misc]  # numba has no types
    """Prints once, when the first kernel is compiled that is not on disk."""

    def __init__(self, may_print: Callable[[], bool]) -> None:
        self._may_print = may_print
        self._seen = False

    def on_start(self, event: Event) -> None:
        first, self._seen = not self._seen, True
        if first and sys.stderr is not None and self._may_print():
            kept = cache_folder(Path(event.data["dispatcher"].py_func.__code__.co_filename)) is not None
            with contextlib.suppress(OSError):  # standard error is closed
                sys.stderr.write(f"mjsim: {NOTICE if kept else NOT_KEPT.format(folder=cache_base())}\n")
                sys.stderr.flush()

    def on_end(self, event: Event) -> None:
        """Do nothing; only the start of the first compilation counts."""


def announce_compiling(may_print: Callable[[], bool] = lambda: True) -> None:
    """Print one line to standard error when a kernel is first compiled from now on, if `may_print()` allows it."""
    register("numba:compile", _Notice(may_print))
