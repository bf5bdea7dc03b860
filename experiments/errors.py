"""Typed errors of the experiments, and descriptions of any error: one line, and where in user code it was raised.

ExperimentError
├── ConfigError     an option of a run or batch is unusable
├── SessionError    a session cannot continue
├── RecordError     a run directory is missing, incomplete or in the way
├── UserCodeError   a user-supplied participant, condition or planner raised, or returned something unusable
├── StatisticsError the data do not allow a statistical test
├── StoreError      the database of a study cannot be used, or what is asked contradicts what it holds
└── ReplayError     a recorded run cannot be replayed, or differs from its record
"""

import inspect
import os
import sysconfig
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("experiments", "hud", "mjsim", "planner", "studies")
LIBRARIES = tuple({path + os.sep for path in sysconfig.get_paths().values()} | {"<frozen "})
CALL_LIMIT = (
    "MJSIM_CALL_LIMIT"  # environment variable: longest call of a user's own code, s; workers inherit it
)
LONGEST = 300  # characters of a message or value that are shown


class ExperimentError(Exception):
    """Base of every error raised by :mod:`experiments`."""


class ConfigError(ExperimentError):
    """An option of a run or batch is unusable."""


class SessionError(ExperimentError):
    """A session cannot continue."""


class RecordError(ExperimentError):
    """A run directory is missing, incomplete or in the way."""


class UserCodeError(ExperimentError):
    """A user-supplied participant, condition or planner raised, or returned something unusable."""


class StatisticsError(ExperimentError):
    """The data do not allow a statistical test; the message says why."""


class StoreError(ExperimentError):
    """The database of a study cannot be used, or what is asked contradicts what it holds; says what to do."""


class ReplayError(ExperimentError):
    """A recorded run cannot be replayed, or differs from its record.

    Attributes:
        step: First bad control step, or None where no step can be named.
        verdicts: A line for every file of the run that was checked.
    """

    def __init__(self, message: str, step: int | None = None, verdicts: Sequence[str] = ()) -> None:
        super().__init__(message)
        self.step = step
        self.verdicts = tuple(verdicts)


def describe(error: BaseException) -> str:
    """An error as one line: its message, preceded by its type unless it is one of this project's errors."""
    # Imported late, so that `mjsim doctor` can name a distribution that hides one of these packages.
    from hud.errors import HudError
    from mjsim.values.errors import MjsimError
    from planner.errors import PlannerError

    try:
        message = " ".join(str(error).split()).encode(errors="backslashreplace").decode()
    except Exception:  # a user's own error
        message = ""
    if isinstance(error, ExperimentError | HudError | MjsimError | PlannerError):
        return message
    return f"{type(error).__name__}: {_cut(message)}" if message else type(error).__name__


def shown(value: object) -> str:
    """A value in a message, whatever it is."""
    try:
        return _cut(" ".join(repr(value).encode(errors="backslashreplace").decode().split()))
    except Exception:  # a user's own type
        return f"a {type(value).__name__}"


def _cut(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."


def is_own_file(file: str) -> bool:
    """Whether a file of code is none of Python, of a library or of this project."""
    own = Path(file).is_absolute() and not file.startswith(
        LIBRARIES
    )  # compiled libraries name relative files
    return own and not any(Path(file).is_relative_to(ROOT / package) for package in PACKAGES)


def place(error: BaseException | None) -> str:
    """File and line of the innermost frame of a user's own code, empty if there is none."""
    trace, found = error.__traceback__ if error is not None else None, ""
    while trace is not None:
        file, module = trace.tb_frame.f_code.co_filename, str(trace.tb_frame.f_globals.get("__name__", ""))
        if is_own_file(file) and module.partition(".")[0] not in PACKAGES:
            found = f" ({file}, line {trace.tb_lineno})"
        trace = trace.tb_next
    return found


def definition(code: object) -> str:
    """File and line where a function is defined, empty if there is none."""
    try:
        found = inspect.unwrap(code).__code__  # type: ignore[arg-type]
        return f" ({found.co_filename}, line {found.co_firstlineno})"
    except Exception:  # something else that can be called
        return ""
