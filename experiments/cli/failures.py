"""Error handling for commands: one-line error messages, exit codes and crash reports."""

import os
import platform
import re
import shutil
import sys
import tempfile
import time
import traceback
from collections.abc import Sequence
from pathlib import Path

from mjsim.support.environment import version_of
from mjsim.support.urls import redacted

FAILED = 1
USAGE_ERROR = 2
INTERNAL_ERROR = 70  # the value of EX_SOFTWARE in sysexits.h
# Error messages of Python for a path that contains a null character
_NULL = ("embedded null byte", "embedded null character")
BROKEN_PIPE = 141  # exit code that shells report for a process killed by SIGPIPE

DISTRIBUTIONS = ("mjsim", "mujoco", "numpy", "numba", "ortools", "opencv-python-headless", "pyarrow")
_SECRET = re.compile(r"(--?[\w-]*(?:token|password|secret|key)[\w-]*)(=|\x00)[^\x00]+", re.IGNORECASE)


def end_with(error: Exception, words: Sequence[str]) -> int:
    """Print a one-line error message to standard error, and return the exit code.

    For a bug in mjsim or in user code, write a report that includes the command line `words`.
    """
    if isinstance(error, BrokenPipeError):
        drop_output()
        return BROKEN_PIPE
    flush_output()
    from experiments.errors import UserCodeError, user_code_location

    code, text = exit_code(error), message(error)
    if code == USAGE_ERROR and (location := user_code_location(error.__cause__)):
        code, text = FAILED, f"{text}{location}; traceback in {_report(error, words)}"
    elif code is None:
        text = f"internal error ({type(error).__name__}: {text}); please send in the report {_report(error, words)}"
    elif isinstance(error, UserCodeError):
        text += f"; traceback in {_report(error, words)}"
    print(f"mjsim: {text}", file=sys.stderr)
    return INTERNAL_ERROR if code is None else code


def exit_code(error: Exception) -> int | None:
    """Return the exit code for an expected error, or None if the error is a bug in mjsim."""
    # These modules are imported here so that `mjsim plan` starts fast.
    from experiments.errors import ExperimentError, ReplayError, UserCodeError
    from hud.errors import HudError
    from mjsim.values.errors import MjsimError, PhysicsError, RenderError
    from planner.errors import PlannerError

    # Errors that are not caused by the arguments, such as a full disk or a missing driver
    failures = (PhysicsError, RenderError, ReplayError, UserCodeError, OSError, MemoryError, ImportError)
    if isinstance(error, failures):
        return FAILED
    if str(error) in _NULL:
        return USAGE_ERROR
    return USAGE_ERROR if isinstance(error, ExperimentError | MjsimError | PlannerError | HudError) else None


def message(error: Exception) -> str:
    if isinstance(error, shutil.Error) and error.args and isinstance(error.args[0], list):
        text = str(error.args[0][0][-1])  # the reason of the first file that could not be copied
    elif isinstance(error, OSError) and error.strerror:
        text = f"{error.filename}: {error.strerror}" if error.filename is not None else error.strerror
    elif isinstance(error, MemoryError):
        text = f"not enough memory ({error})" if str(error) else "not enough memory"
    elif isinstance(error, ImportError):
        text = f"{error}; `mjsim doctor` shows what is missing"
    elif str(error) in _NULL:
        text = "a path has a null character in it; correct the file that names it"
    else:
        text = str(error)
    from mjsim.values.errors import brief

    return brief(redacted(text))


def drop_output() -> None:
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.close(null)


def flush_output() -> None:
    if sys.stdout is not None:
        try:
            sys.stdout.flush()
        except OSError:
            drop_output()


def _report(error: Exception, words: Sequence[str]) -> str:
    text = _report_text(error, words)
    from platformdirs import user_log_path

    for folder in (user_log_path("mjsim", appauthor=False), Path(tempfile.gettempdir())):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(prefix=time.strftime("%Y%m%d-%H%M%S-"), suffix=".txt", dir=folder)
            with open(handle, "w", encoding="utf-8", errors="backslashreplace") as file:  # noqa: PTH123 - a descriptor
                file.write(text)
        except OSError:
            continue
        return name
    return "(which could not be written)"


def _report_text(error: Exception, words: Sequence[str]) -> str:
    command = _SECRET.sub(r"\1\2***", "\x00".join(map(redacted, words))).replace("\x00", " ")
    versions = "\n".join(f"{name} {version_of(name) or 'not installed'}" for name in DISTRIBUTIONS)
    trace = redacted("".join(traceback.format_exception(error)))
    text = (
        f"mjsim {command}\npython {platform.python_version()} on {platform.platform()}\n{versions}\n\n{trace}"
    )
    return text.replace(str(Path.home()), "~") if str(Path.home()) != "/" else text
