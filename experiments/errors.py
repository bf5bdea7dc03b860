"""The exceptions of this package, and functions that format values and errors for messages.

ExperimentError
├── ConfigError     an option of a run or batch is not usable
├── SessionError    a session cannot continue
├── RecordError     a run folder is missing, incomplete or already exists
├── UserCodeError   a custom participant, condition or planner fails or returns an invalid value
├── StatisticsError the data do not allow a statistical test
├── StoreError      the database of a study is not usable, or a request contradicts its content
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
# Environment variable with the time limit for one call of user code, in seconds. Worker processes inherit it.
CALL_LIMIT = "MJSIM_CALL_LIMIT"
MAX_SHOWN = 300  # maximum length of a value in an error message, in characters


class ExperimentError(Exception):
    """Base class of all exceptions raised by :mod:`experiments`."""


class ConfigError(ExperimentError):
    """Raised if an option of a run or batch is not valid."""


class SessionError(ExperimentError):
    """Raised if a session cannot continue."""


class RecordError(ExperimentError):
    """Raised if a run folder is missing or incomplete, or if a new run folder already exists."""


class UserCodeError(ExperimentError):
    """Raised if a custom participant, condition or planner fails or returns an invalid value."""


class StatisticsError(ExperimentError):
    """Raised if the data do not allow a statistical test. The message states the reason."""


class StoreError(ExperimentError):
    """Raised if a study database cannot be used, or if a request contradicts its contents."""


class ReplayError(ExperimentError):
    """Raised if a recorded run cannot be replayed, or if the replay differs from the record.

    Attributes:
        step: First control step with a difference, or None if the cause is not a single step.
        verdicts: Results of the comparison, one line per file.
    """

    def __init__(self, message: str, step: int | None = None, verdicts: Sequence[str] = ()) -> None:
        super().__init__(message)
        self.step = step
        self.verdicts = tuple(verdicts)


def describe(error: BaseException) -> str:
    """Describe an exception in one line. The type is included unless this project defines the exception."""
    # Import these here so that `mjsim doctor` works even if another distribution shadows one of the packages.
    from hud.errors import HudError
    from mjsim.values.errors import MjsimError
    from planner.errors import PlannerError

    try:
        message = " ".join(str(error).split()).encode(errors="backslashreplace").decode()
    except Exception:  # custom exceptions may fail to format
        message = ""
    if isinstance(error, ExperimentError | HudError | MjsimError | PlannerError):
        return message
    return f"{type(error).__name__}: {_cut(message)}" if message else type(error).__name__


def shown(value: object) -> str:
    """Return the `repr` of a value, shortened for error messages."""
    try:
        return _cut(" ".join(repr(value).encode(errors="backslashreplace").decode().split()))
    except Exception:  # custom classes may fail to format
        return f"a {type(value).__name__}"


def _cut(text: str) -> str:
    return text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]}..."


def user_code_location(error: BaseException | None) -> str:
    """Return the file and line of the innermost frame in user code, or an empty string."""
    trace, found = error.__traceback__ if error is not None else None, ""
    while trace is not None:
        file, module = trace.tb_frame.f_code.co_filename, str(trace.tb_frame.f_globals.get("__name__", ""))
        if _is_user_file(file) and module.partition(".")[0] not in PACKAGES:
            found = f" ({file}, line {trace.tb_lineno})"
        trace = trace.tb_next
    return found


def _is_user_file(file: str) -> bool:
    if not Path(file).is_absolute() or file.startswith(LIBRARIES):  # compiled libraries have relative paths
        return False
    return not any(Path(file).is_relative_to(ROOT / package) for package in PACKAGES)


def listed(names: Sequence[str], most: int = 3) -> str:
    """Return up to `most` names, separated by commas, and how many more there are."""
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")


def definition(code: object) -> str:
    """Return the file and line at which a function is defined, or an empty string if unknown."""
    try:
        found = inspect.unwrap(code).__code__  # type: ignore[arg-type]
        return f" ({found.co_filename}, line {found.co_firstlineno})"
    except Exception:  # not a Python function
        return ""
