"""A command with code of a user's own runs in a child: where that code ends the process, the trial is kept.

The child counts the calls of such code. Where it dies in one, another child runs the command again up to this call,
which then raises an error in its name. Trials repeat bit for bit, so that this one keeps what was simulated before.
"""

import ctypes
import faulthandler
import os
import re
import signal
import struct
import tempfile
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, NoReturn

from experiments.errors import UserCodeError
from experiments.session.signals import SIGNALS
from mjsim.files import remove_work

CRASHES = (signal.SIGSEGV, signal.SIGABRT, signal.SIGBUS, signal.SIGFPE, signal.SIGILL)
_NAMES = ("user", "assistance", "training_assistance", "planner")
_OWN = re.compile(r":[A-Za-z_]")  # package.module:attribute
_FRAME = re.compile(r'File "([^"]+)", line (\d+)')
_SHARED = "MJSIM_OWN_PROCESS"  # names the file that a child shares with its parent, and the child
_CALLS, _CALLED, _ENDED, _FATAL, _HOW, _WHAT = 0, 8, 16, 24, 32, 4128  # places in that file


@dataclass(frozen=True)
class SharedCalls:
    """What a parent knows of its child's calls of a user's own code; what is written outlasts the child.

    Attributes:
        file: Descriptor of a file that both processes have open.
    """

    file: int

    def read(self, place: int) -> int:
        """The number at a place of the file."""
        return int(struct.unpack("q", os.pread(self.file, 8, place))[0])

    def write(self, place: int, value: int) -> None:
        """Write a number at a place of the file."""
        os.pwrite(self.file, struct.pack("q", value), place)

    def read_text(self, place: int) -> str:
        """The text at a place of the file."""
        return os.pread(self.file, _WHAT - _HOW, place).decode(errors="replace").rstrip("\0")

    def write_text(self, place: int, text: str) -> None:
        """Write a text at a place of the file."""
        size = _WHAT - _HOW
        os.pwrite(self.file, text.encode(errors="replace")[:size].ljust(size, b"\0"), place)

    def begin(self, what: str) -> None:
        """A call of a user's own code begins; raises a `UserCodeError` if it is the fatal one."""
        number = self.read(_CALLS) + 1
        if number == self.read(_FATAL):
            raise UserCodeError(f"{what} {self.read_text(_HOW)}")
        self.write(_CALLS, number)
        self.write(_CALLED, 1)
        self.write_text(_WHAT, what)

    def end(self) -> None:
        """The call came back."""
        self.write(_CALLED, 0)

    def restart(self, fatal: int, how: str) -> None:
        """Count again, for another child that must not make the call of the number `fatal`."""
        os.pwrite(self.file, struct.pack("4q", 0, 0, 0, fatal), 0)
        self.write_text(_HOW, how)
        self.write_text(_WHAT, "")


def shared_calls() -> SharedCalls | None:
    """What this process shares with a parent that watches it; None where there is none."""
    file, _, child = os.environ.get(_SHARED, "").partition(":")
    return SharedCalls(int(file)) if child == str(os.getpid()) else None


def tell_end() -> None:
    """Tell the parent, where there is one that watches, that the command came to its end."""
    if (shared := shared_calls()) is not None:
        shared.write(_ENDED, 1)


def in_own_child(arguments: Any) -> int | None:
    """Continue in a child, where this returns None, if a command has code of a user's own; here, its exit code."""
    given = vars(arguments)
    if not any(_OWN.search(str(given.get(name))) for name in _NAMES):
        return None
    places = (given.get(name) for name in ("out", "video", "certificate"))
    return _in_child([place.absolute().parent for place in places if isinstance(place, Path)])


def _in_child(folders: Iterable[Path]) -> int | None:
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)  # whoever started this may have ignored it
    shared, fatal, how = SharedCalls(os.memfd_create("mjsim-calls")), 0, ""
    for _ in range(2):
        shared.restart(fatal, how)
        with tempfile.TemporaryFile("w+", errors="replace") as dump:
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {*SIGNALS, signal.SIGCHLD})
            if (child := os.fork()) == 0:
                os.environ[_SHARED] = f"{shared.file}:{os.getpid()}"
                _begin(dump, before)
                return None
            code = _wait(child)
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            if shared.read(_ENDED) or (code < 0 and -code not in CRASHES):
                return code if code >= 0 else 128 - code
            for folder in folders:
                remove_work(folder, child)
            dump.seek(0)
            how = f"ended the process{f' by {signal.Signals(-code).name}' if code < 0 else ''}{_where(dump.read())}"
        if not shared.read(_CALLED):
            last = f"; the last was of {what}" if (what := shared.read_text(_WHAT)) else ""
            raise UserCodeError(f"code of your own {how}, outside of its calls{last}")
        fatal = shared.read(_CALLS)
    raise UserCodeError(
        f"code of your own {how}; it does so at different calls, so that nothing could be kept"
    )


def refuse_exit() -> Callable[[int], NoReturn]:
    """Let `os._exit` of this thread raise `SystemExit`; other threads and processes end as they ask. What it was."""
    leave, here = os._exit, (os.getpid(), threading.get_ident())

    def refuse(status: int) -> NoReturn:
        if here == (os.getpid(), threading.get_ident()):
            raise SystemExit(status)
        leave(status)

    os._exit = refuse
    return leave


def _begin(dump: IO[str], mask: Iterable[int]) -> None:
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG: end with the parent
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    faulthandler.enable(open(os.dup(dump.fileno()), "w"), all_threads=False)  # noqa: PTH123, SIM115 - as long as the process
    refuse_exit()


def _wait(child: int) -> int:
    """The exit code of a child, negative for a signal; signals that were sent to this process alone are passed on."""
    while True:
        found = signal.sigwaitinfo({*SIGNALS, signal.SIGCHLD})
        if found.si_signo != signal.SIGCHLD and found.si_code <= 0:  # by a process, not by a terminal
            os.kill(child, found.si_signo)
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            return os.waitstatus_to_exitcode(status)


def _where(dump: str) -> str:
    """File and line of the innermost frame of a user's own code, from what `faulthandler` wrote."""
    from experiments.blame import is_own_file  # `mjsim doctor` starts without the packages that it loads

    frames = [(file, line) for file, line in _FRAME.findall(dump) if is_own_file(file)]
    return f" ({frames[0][0]}, line {frames[0][1]})" if frames else ""
