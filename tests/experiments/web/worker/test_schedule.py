"""The clock of a page that stamps its inputs: each counts exactly once, at its step or, if it is late, the next one."""

import itertools
from collections import deque
from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.web.controls import Input
from experiments.web.state import Trigger
from experiments.web.worker.clock import PATIENCE, WINDOW, Schedule
from experiments.web.worker.control import SessionControl

PERIOD = 0.04  # s
ROUNDING = 1e-6  # s


@dataclass
class Page:
    """What a page sends at its own pace: the inputs of every control step, and the promise that there are no more.

    Attributes:
        pressed: How many inputs it makes in each control step.
        delays: What each message takes, s; messages do not overtake each other.
        batch: How many control steps it puts into one message.
        again: Messages whose inputs it sends once more in the next one, as after a new connection.
        period: Of its control steps, s by the server's clock.
    """

    pressed: list[int]
    delays: list[float] = field(default_factory=lambda: [0.0])
    batch: int = 1
    again: frozenset[int] = frozenset()
    period: float = PERIOD

    @property
    def inputs(self):
        """All inputs, in order."""
        steps = itertools.chain.from_iterable([step] * count for step, count in enumerate(self.pressed))
        return [Input(number=number, step=step) for number, step in enumerate(steps, 1)]

    def messages(self):
        """When each message arrives, s, its inputs, and its promise."""
        inputs, arrived = deque(self.inputs), 0.0
        before = []
        for until in range(1, len(self.pressed) + 1):
            if until % self.batch and until < len(self.pressed):
                continue
            new = []
            while inputs and inputs[0].step < until:
                new.append(inputs.popleft())
            arrived = max(arrived, until * self.period + self.delays[until % len(self.delays)])
            yield arrived, before + new, until
            before = new if until in self.again else []


def play(page):
    """When each control step was taken, s, and the numbers of the inputs that counted at it."""
    now, taken = 0.0, []
    control = SessionControl(lambda _: None, lambda: now)
    control.apply(Trigger.OPENED)
    control.apply(Trigger.RUN, until=0)
    schedule, messages = Schedule(PERIOD, now), deque(page.messages())
    while len(taken) < len(page.pressed) or len(counted(taken)) < len(page.inputs):
        while messages and messages[0][0] <= now:
            _, inputs, until = messages.popleft()
            control.add(inputs, until)
        promise = control.wait_for_promise(len(taken), 0.0)
        wait = schedule.wait(now, promised=not promise.missing)
        if wait > 0.0:
            now = min([now + wait, *(at for at, _, _ in itertools.islice(messages, 1))])
            continue
        taken.append((now, [new.number for new in control.take_inputs(len(taken))]))
        schedule.take(promise.came)
    return taken


def counted(taken):
    """The control step at which each input counted, by number."""
    return {number: step for step, (_, numbers) in enumerate(taken) for number in numbers}


pages = st.builds(
    Page,
    pressed=st.lists(st.sampled_from([0, 0, 0, 1, 2]), min_size=1, max_size=80),
    delays=st.lists(st.floats(0.0, 1.5), min_size=1, max_size=9),
    batch=st.integers(1, 6),
    again=st.frozensets(st.integers(1, 80)),
    period=st.floats(0.03, 0.05),
)


@given(pages)
def test_each_input_counts_once_in_order_and_never_before_its_step(page):
    taken = play(page)
    numbers = list(itertools.chain.from_iterable(numbers for _, numbers in taken))
    assert numbers == [new.number for new in page.inputs]
    steps = counted(taken)
    assert all(steps[new.number] >= new.step for new in page.inputs)


@given(pages)
def test_what_is_late_counts_at_the_next_step(page):
    taken, steps = play(page), counted(play(page))
    arrived = {}
    for at, inputs, _ in page.messages():
        for new in inputs:
            arrived.setdefault(new.number, at)
    for new in page.inputs:
        step = steps[new.number]
        assert step == new.step or taken[step - 1][0] < arrived[new.number] + ROUNDING


@given(st.builds(Page, pages.map(lambda page: page.pressed), st.lists(st.floats(0.0, 0.45), min_size=1)))
def test_no_input_misses_its_step_where_messages_take_less_than_the_patience(page):
    assert counted(play(page)) == {new.number: new.step for new in page.inputs}


@given(pages)
@settings(max_examples=30)
def test_no_step_is_taken_much_after_its_time(page):
    for step, (at, _) in enumerate(play(page)):
        shifts = step / WINDOW * (PATIENCE + 2 * PERIOD)  # by which a slow page moves the schedule
        assert at <= step * PERIOD + PATIENCE + shifts + ROUNDING


def waits(page):
    """For how long the inputs of each control step had been there when it was taken, s."""
    arrivals = [(at, until) for at, _, until in page.messages()]
    came = [next(at for at, until in arrivals if until > step) for step in range(len(page.pressed))]
    return [at - there for (at, _), there in zip(play(page), came, strict=False)]


@pytest.mark.parametrize("period", [0.0399, 0.04, 0.0401])
@pytest.mark.parametrize("delay", [0.005, 0.2])
def test_the_clock_follows_that_of_the_page(period, delay):
    found = waits(Page([0] * 3000, [delay, delay + 0.01, delay + 0.02], period=period))
    assert max(found[200:]) < 0.035


def test_after_a_stall_the_clock_catches_up_at_once():
    stalled = Page([0] * 400, [0.05] * 200 + [0.4] + [0.05] * 199)
    assert max(waits(stalled)[230:]) < 0.002


def test_steps_that_come_together_are_taken_together():
    times = [at for at, _ in play(Page([0] * 300, [0.05], batch=5))]
    assert len({round(at, 6) for at in times[200:]}) == pytest.approx(20, abs=1)
