"""When control steps are taken: in real time, and not before the inputs that a page has promised for them."""

PATIENCE = 0.75  # s after its time at which a control step is taken without the inputs that were promised
WINDOW = 25  # control steps after which the clock follows that of the page
PULL = 0.05  # share by which it may run faster for that


class Schedule:
    """Control steps are due every `period` s from `due` on.

    A page that promises its inputs has a clock of its own, and its promises travel. If all promises of a while came
    after the steps for which they were due, steps are due later from then on; if all came before, earlier. What comes
    late once is waited for, and the steps that have become due meanwhile follow at once.

    Attributes:
        due: When the next control step is due, s.
    """

    def __init__(self, period: float, now: float) -> None:
        self.due = now
        self._period = period
        self._late: list[float] = []  # by how much promises came after their steps were due, s

    def start(self, now: float) -> None:
        """Begin anew: a control step is due now."""
        self.due = now
        self._late.clear()

    def wait(self, now: float, *, promised: bool) -> float:
        """How long to wait before the next control step, s; `promised` is whether its inputs are there."""
        return max(0.0, self.due + (0.0 if promised else PATIENCE) - now)

    def take(self, came: float | None) -> None:
        """The control step is taken; `came` is when its inputs were there, None where nothing is promised."""
        if came is None:
            self._late.clear()
        else:
            self._late.append(came - self.due)
        self.due += self._period
        if len(self._late) == WINDOW:
            earliest, latest = min(self._late), max(self._late)
            self._late.clear()
            self.due += max(0.0, earliest) + max(min(0.0, latest), -PULL * WINDOW * self._period)
