"""`mjsim` whose clock is wrong by the seconds that a file says, from one moment to the next.

Words of its command line: the file; a pause, s, after which the command is done again, for ever, or 0; the command.
Only the wall clock is wrong: no setting of a machine's clock changes the monotonic one.
"""

import datetime
import sys
import time
from pathlib import Path

from experiments.cli.main import main
from experiments.visit.store import values


def step_clock(file):
    right = time.time

    class WrongTime(datetime.datetime):
        @classmethod
        def now(cls, tz=None):
            return datetime.datetime.now(tz) + datetime.timedelta(seconds=float(file.read_text()))

    values.datetime = WrongTime
    time.time = lambda: right() + float(file.read_text())


if __name__ == "__main__":
    _, clock, pause, *words = sys.argv
    step_clock(Path(clock))
    while True:
        status = main(words)
        if not float(pause):
            sys.exit(status)
        time.sleep(float(pause))
