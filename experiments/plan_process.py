"""Planning in a process of its own, so that time limits and signals hold whatever a planner is busy with."""

import base64
import ctypes
import json
import os
import pickle
import select
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NoReturn, TextIO

from planner.errors import PlannerError

GRACE = 0.15  # s beyond a time limit after which the planner is stopped
GRACE_FOR_FIRST = (
    0.45  # s, where it has not given any tour yet: a process may take so long to start on a busy machine
)
ON_TERMINAL, ELSEWHERE = 1.0, 10.0  # s between reports of progress
_PR_SET_PDEATHSIG = 1  # of Linux's prctl


@dataclass(frozen=True)
class Answer:
    """A plan as text, best of all so far.

    Attributes:
        plan: What `mjsim plan` prints.
        claim: What `--certificate` writes.
        cost: Length of the tour, m.
        lower_bound: No tour is shorter than this, m.
    """

    plan: str
    claim: str
    cost: float
    lower_bound: float


class PlanProcess:
    """Runs a planner in a child process, and keeps the best answer.

    Args:
        answers: Yields better and better answers; runs in the child.
        seconds: Time limit, from now; None for none.

    Attributes:
        best: The last answer, or None.
    """

    def __init__(self, answers: Callable[[], Iterator[Answer]], seconds: float | None) -> None:
        self.best: Answer | None = None
        self._seconds = seconds
        self._started = time.perf_counter()
        self._pipe, writing = os.pipe()
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:  # it is None where the descriptor is closed
                stream.flush()
        parent = os.getpid()
        self._child = os.fork()
        if self._child == 0:
            os.close(self._pipe)
            _send_all(answers, writing, parent)
        os.close(writing)

    def wait(self, progress: TextIO) -> Answer:
        """The best answer, once there is none better to come or the time is over; reports progress meanwhile.

        Raises:
            Exception: What ended the planner.
            PlannerError: There is no answer.
        """
        report = _Progress(progress, self._started)
        try:
            for message in self._messages(report):
                if "error" in message:
                    raise pickle.loads(base64.b64decode(message["error"]))
                self.best = Answer(**message)
        finally:
            report.end()
            self.stop()
        if self.best is None:
            limit = f" within {self._seconds:g} s" if self._seconds is not None else ""
            raise PlannerError(f"no tour was found{limit}; allow more time, or more memory")
        return self.best

    def stop(self) -> None:
        """End the child."""
        if self._child:
            os.kill(self._child, signal.SIGKILL)
            os.waitpid(self._child, 0)
            os.close(self._pipe)
            self._child = 0

    def _messages(self, report: "_Progress") -> Iterator[dict[str, Any]]:
        buffer = b""
        while True:
            passed = time.perf_counter() - self._started
            grace = GRACE if self.best else GRACE_FOR_FIRST
            left = 3600.0 if self._seconds is None else self._seconds + grace - passed
            if left <= 0:
                return
            if not select.select([self._pipe], [], [], min(left, 0.2))[0]:
                report.tick(self.best)
                continue
            chunk = os.read(self._pipe, 1 << 16)
            if not chunk:
                return
            *lines, buffer = (buffer + chunk).split(b"\n")
            yield from map(json.loads, lines)


class _Progress:
    """Says from time to time how far the planner is: one line that is rewritten on a terminal, else a line each."""

    def __init__(self, stream: TextIO, started: float) -> None:
        self._stream, self._started = stream, started
        self._terminal = stream.isatty()
        self._every = ON_TERMINAL if self._terminal else ELSEWHERE
        self._next = started + self._every
        self._shown = False

    def tick(self, best: Answer | None) -> None:
        now = time.perf_counter()
        if now < self._next:
            return
        self._next, self._shown = now + self._every, True
        text = f"planning for {now - self._started:.0f} s"
        if best is not None:
            gap = 100 * (1 - best.lower_bound / best.cost) if best.cost else 0.0
            text += f"; the best tour so far is {best.cost:.6g} long, at most {gap:.2g} % of it too much"
        ends = ("\r\x1b[K", "") if self._terminal else ("", "\n")
        print(f"{ends[0]}mjsim: {text}", end=ends[1], file=self._stream, flush=True)

    def end(self) -> None:
        if self._shown and self._terminal:
            print("\r\x1b[K", end="", file=self._stream, flush=True)


def _send_all(answers: Callable[[], Iterator[Answer]], pipe: int, parent: int) -> NoReturn:
    """The child: one line of JSON per answer; it ends with its parent, and leaves signals from a terminal to it."""
    try:
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        for number in (signal.SIGINT, signal.SIGHUP):
            signal.signal(number, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        if os.getppid() == parent:
            with os.fdopen(pipe, "w") as lines:
                _send(answers, lines)
    finally:
        os._exit(0)


def _send(answers: Callable[[], Iterator[Answer]], lines: TextIO) -> None:
    try:
        for answer in answers():
            print(json.dumps(vars(answer)), file=lines, flush=True)
    except BaseException as error:
        error.add_note(f"In the planner's process:\n{traceback.format_exc()}")
        print(json.dumps({"error": base64.b64encode(pickle.dumps(error)).decode()}), file=lines, flush=True)
