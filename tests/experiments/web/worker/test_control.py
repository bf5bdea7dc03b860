"""The state machine of a session, and the inputs that wait for it."""

import time
from unittest.mock import ANY

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.web.controls import Input
from experiments.web.state import (
    FAILED,
    LOADING,
    OVER,
    PAUSED,
    READY,
    RUNNING,
    TRANSITIONS,
    SessionPhase,
    Trigger,
)
from experiments.web.worker.control import MAX_NOTES, SessionControl


def after(*triggers, **clock):
    """Phases that a session announces, and its control."""
    phases = []
    control = SessionControl(lambda state: phases.append(state.phase), **clock)
    for trigger in triggers:
        control.apply(trigger)
    return phases, control


@pytest.mark.parametrize(
    ("triggers", "phases"),
    [
        (("opened", "run", "pause", "run", "end"), (READY, RUNNING, PAUSED, RUNNING, OVER)),
        (("restored", "run"), (PAUSED, RUNNING)),
        (("run", "pause", "opened", "pause", "end", "run"), (READY, OVER)),
        (("end", "opened", "restored"), (OVER,)),
        (("opened", "fail", "run", "end"), (READY, FAILED)),
    ],
)
def test_a_life_follows_the_table(triggers, phases):
    assert tuple(after(*map(Trigger, triggers))[0]) == phases


@given(st.lists(st.sampled_from(Trigger)))
def test_only_transitions_of_the_table_happen(triggers):
    phases, _ = after(*triggers)
    for before, then in zip([LOADING, *phases], phases, strict=False):
        assert then in {TRANSITIONS.get((before, trigger)) for trigger in Trigger}
    assert set(SessionPhase) - {LOADING} == set(TRANSITIONS.values()), "every phase is reached"


def test_what_is_sent_again_counts_once():
    _, control = after()
    control.apply(Trigger.RESTORED, "disconnected", last=7)
    for numbers in ((7, 8), (8, 9, 10), (10,), (11,)):
        control.add([Input(number=number) for number in numbers])
    assert [new.number for new in control.take_inputs(0)] == [8, 9, 10, 11]
    assert control.take_inputs(0) == () and control.state.input == 11
    assert control.state.reason == "disconnected"


def test_what_comes_while_the_clock_stands_holds_and_presses_nothing():
    _, control = after(Trigger.OPENED, Trigger.RUN)
    control.add([Input(number=1, forward=1.0, press="act", scroll=2)])
    control.apply(Trigger.PAUSE, "silent")
    control.add([Input(number=2, yaw=1.0, press="act", scroll=3)])
    assert control.take_inputs(0) == (Input(number=1, scroll=2), Input(number=2, scroll=3))


def test_a_silent_page_stops_the_clock():
    now = [100.0]
    phases, control = after(Trigger.OPENED, Trigger.RUN, now=lambda: now[0])
    for _ in range(5):
        now[0] += 0.9
        control.hear()
        control.pause_if_silent()
    assert phases == [READY, RUNNING]
    now[0] += 1.1
    control.pause_if_silent()
    assert control.state.phase is PAUSED and control.state.reason == "silent"
    control.hear()
    control.apply(Trigger.RUN)
    assert phases == [READY, RUNNING, PAUSED, RUNNING]
    assert [event for event, _ in control.take_notes()] == ["started", "pause", "resume"]


def test_notes_of_a_page_have_an_end():
    _, control = after(Trigger.OPENED)
    for _ in range(MAX_NOTES + 10):
        control.note("blur", away=True)
    assert len(control.take_notes()) == MAX_NOTES


def test_start_pauses_and_blurs_are_noted_in_order_with_their_time():
    _, control = after(Trigger.OPENED, Trigger.RUN, Trigger.PAUSE)
    control.note("blur", away=True)
    control.apply(Trigger.RUN)
    notes = control.take_notes()
    assert [event for event, _ in notes] == ["started", "pause", "blur", "resume"]
    assert all(fields["wall"] > 0.0 for _, fields in notes) and control.take_notes() == []


def test_inputs_count_at_their_step_or_at_the_next_one_in_order():
    _, control = after(Trigger.OPENED, Trigger.RUN)
    stamps = {1: 3, 2: None, 3: 5, 4: 4, 5: 6}  # number -> step; one without a step waits for those before it
    control.add([Input(number=number, step=step) for number, step in stamps.items()], until=7)
    taken = [[new.number for new in control.take_inputs(step)] for step in range(2, 8)]
    assert taken == [[], [1, 2], [], [3, 4], [5], []]


def test_the_clock_waits_for_what_was_promised_only():
    _, control = after(Trigger.OPENED, Trigger.RUN)
    assert control.wait_for_promise(0, 60.0) == (None, False), (
        "a page that promises nothing is not waited for"
    )
    control.add([], until=3)
    came = control.wait_for_promise(2, 60.0).came
    assert came is not None and control.wait_for_promise(3, 0.01) == (None, True)
    control.apply(Trigger.PAUSE, "asked")
    control.apply(Trigger.RUN)
    assert control.wait_for_promise(3, 60.0) == (None, False), "a pause forgets promises"
    control.apply(Trigger.PAUSE, "asked")
    control.apply(Trigger.RUN, until=0)
    assert control.wait_for_promise(3, 0.01).missing, "a page that lets the clock run can announce promises"


def test_who_connects_is_shown_the_session_at_once():
    _, control = after("opened")
    control.ask_to_show()
    began = time.monotonic()
    control.wait_for_change(READY, 10.0)
    assert time.monotonic() - began < 5.0


@pytest.mark.parametrize("events", [("opened", "show"), ("show", "opened")])
def test_a_session_waits_for_its_person_from_when_it_is_ready_and_shown(events):
    now = [100.0]
    _, control = after(now=lambda: now[0])
    for event in events:
        now[0] += 5.0
        control.ask_to_show() if event == "show" else control.apply(event)
    now[0] += 2.5
    control.ask_to_show()  # a page that is loaded again
    control.apply("run")
    assert control.take_notes() == [("started", {"waited_s": 2.5, "wall": ANY})]
