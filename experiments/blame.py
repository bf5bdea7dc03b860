"""What is said about an error: one line, and where in a user's own code it was raised."""

import inspect
import os
import sysconfig
from pathlib import Path

from experiments.errors import ExperimentError
from hud.errors import HudError
from mjsim.values.errors import MjsimError
from planner.errors import PlannerError

ROOT = Path(__file__).resolve().parents[1]
OUR_ERRORS = (ExperimentError, HudError, MjsimError, PlannerError)
PACKAGES = ("experiments", "hud", "mjsim", "planner", "studies")
LIBRARIES = tuple({path + os.sep for path in sysconfig.get_paths().values()} | {"<frozen "})
CALL_LIMIT = (
    "MJSIM_CALL_LIMIT"  # environment variable: longest call of a user's own code, s; workers inherit it
)
LONGEST = 300  # characters of a message or value that are shown


def describe(error: BaseException) -> str:
    """An error as one line: its message, preceded by its type unless it is one of this project's errors."""
    try:
        message = " ".join(str(error).split()).encode(errors="backslashreplace").decode()
    except Exception:  # a user's own error
        message = ""
    if isinstance(error, OUR_ERRORS):
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
