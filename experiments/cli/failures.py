"""How a command ends that failed: one line and an exit code; where the fault may be ours, a report as well."""

import os
import platform
import re
import sys
import tempfile
import time
import traceback
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

FAILED = 1
USAGE_ERROR = 2
INTERNAL_ERROR = 70  # EX_SOFTWARE of sysexits.h
_NULL = ("embedded null byte", "embedded null character")  # what Python says of a path that holds one
BROKEN_PIPE = 141  # what shells show for a program that SIGPIPE ended

DISTRIBUTIONS = ("mjsim", "mujoco", "numpy", "numba", "ortools", "opencv-python-headless", "pyarrow")
_SECRET = re.compile(r"(--?[\w-]*(?:token|password|secret|key)[\w-]*)(=|\x00)[^\x00]+", re.IGNORECASE)


def end_with(error: Exception, words: Sequence[str]) -> int:
    """Say on standard error what went wrong, in one line; the exit code. `words` is the command line, for a report."""
    if isinstance(error, BrokenPipeError):  # the reader of the output closed it
        drop_output()
        return BROKEN_PIPE
    flush_output()
    code, text = exit_code(error), message(error)
    if code == USAGE_ERROR and (own := _own_place(error)):  # a user's own code could not be loaded
        code, text = FAILED, f"{text}{own}; traceback in {_report(error, words)}"
    elif code is None:
        text = f"internal error ({type(error).__name__}: {text}); please send in the report {_report(error, words)}"
    elif _is_user_code(error):
        text += f"; traceback in {_report(error, words)}"
    print(f"mjsim: {text}", file=sys.stderr)
    return INTERNAL_ERROR if code is None else code


def exit_code(error: Exception) -> int | None:
    """The exit code of an error whose message is enough for the user; None for a bug of ours."""
    # Imported only on errors, so that `mjsim plan` starts fast.
    from experiments.errors import ExperimentError, ReplayError, UserCodeError
    from hud.errors import HudError
    from mjsim.values.errors import MjsimError, PhysicsError, RenderError
    from planner.errors import PlannerError

    # A full disk, a missing driver, a broken installation: no other command line would help.
    failures = (PhysicsError, RenderError, ReplayError, UserCodeError, OSError, MemoryError, ImportError)
    if isinstance(error, failures):
        return FAILED
    if str(error) in _NULL:
        return USAGE_ERROR
    return USAGE_ERROR if isinstance(error, ExperimentError | MjsimError | PlannerError | HudError) else None


def message(error: Exception) -> str:
    """What an error says, in one line."""
    if isinstance(error, OSError) and error.strerror:
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

    return brief(text)


def drop_output() -> None:
    """Let standard output lead nowhere, so that Python does not fail once more when it ends."""
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.close(null)


def flush_output() -> None:
    """Write what waits; where nothing takes it, drop it."""
    if sys.stdout is not None:
        try:
            sys.stdout.flush()
        except OSError:
            drop_output()


def _is_user_code(error: Exception) -> bool:
    from experiments.errors import UserCodeError

    return isinstance(error, UserCodeError)


def _own_place(error: Exception) -> str:
    """File and line of a user's own code that raised the cause of an error, empty if there is none."""
    from experiments.errors import place

    return place(error.__cause__)


def _report(error: Exception, words: Sequence[str]) -> str:
    """Write a report; its path."""
    text = _report_text(error, words)
    for folder in (_report_folder(), Path(tempfile.gettempdir())):
        try:
            folder.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(prefix=time.strftime("%Y%m%d-%H%M%S-"), suffix=".txt", dir=folder)
            with open(handle, "w", encoding="utf-8", errors="backslashreplace") as file:  # noqa: PTH123 - a descriptor
                file.write(text)
        except OSError:
            continue
        return name
    return "(which could not be written)"


def _report_folder() -> Path:
    from platformdirs import user_log_path

    return user_log_path("mjsim", appauthor=False)


def _report_text(error: Exception, words: Sequence[str]) -> str:
    command = _SECRET.sub(r"\1\2***", "\x00".join(words)).replace("\x00", " ")
    versions = "\n".join(f"{name} {_version(name)}" for name in DISTRIBUTIONS)
    trace = "".join(traceback.format_exception(error))
    text = (
        f"mjsim {command}\npython {platform.python_version()} on {platform.platform()}\n{versions}\n\n{trace}"
    )
    return text.replace(str(Path.home()), "~") if str(Path.home()) != "/" else text


def _version(distribution: str) -> str:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return "not installed"
