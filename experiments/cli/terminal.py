"""Consoles and progress bars that write to standard error."""

import contextlib
import os
import sys
from typing import IO, TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress, ProgressColumn


class _TolerantStream:
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
    """Create a console for standard error. Writing to it never fails, even if the stream is closed."""
    from rich.console import Console

    stream = open(os.devnull, "w") if sys.stderr is None else sys.stderr  # noqa: PTH123, SIM115 - as long as the process
    return Console(file=cast(IO[str], _TolerantStream(stream)), highlight=False)


def progress_bars(console: "Console", *columns: "str | ProgressColumn") -> "Progress":
    """Create progress bars. If the console is not a terminal, they print a line every few seconds instead."""
    from rich.progress import Progress

    from experiments.cli.progress_lines import ProgressLines

    return Progress(*columns, console=console) if console.is_terminal else ProgressLines(console=console)


def counting_bars(label: str, *columns: "str | ProgressColumn") -> "Progress":
    """Create progress bars that show a label, a count, the elapsed and remaining time, and extra columns."""
    from rich.progress import BarColumn, MofNCompleteColumn, TimeElapsedColumn, TimeRemainingColumn

    counting = (BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), "left", TimeRemainingColumn())
    return progress_bars(error_console(), label, *counting, *columns)
