"""The terminal of a command: progress and results, on standard error."""

import contextlib
import os
import sys
from typing import IO, TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress, ProgressColumn


class _Tolerant:
    """A stream whose reader may close it: later output is dropped, and the command continues."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        with contextlib.suppress(OSError, ValueError):
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        with contextlib.suppress(OSError, ValueError):
            self._stream.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def error_console() -> "Console":
    """A console on standard error that never fails."""
    from rich.console import Console

    stream = open(os.devnull, "w") if sys.stderr is None else sys.stderr  # noqa: PTH123, SIM115 - as long as the process
    return Console(file=cast(IO[str], _Tolerant(stream)), highlight=False)


def progress_bars(console: "Console", *columns: "str | ProgressColumn") -> "Progress":
    """Progress bars on a terminal; nothing in a log, where they would be in the way."""
    from rich.progress import Progress

    return Progress(*columns, console=console, disable=not console.is_terminal)
