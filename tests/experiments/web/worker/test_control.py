"""The state machine of a session, and the inputs that wait for it."""

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
from experiments.web.worker.control import SessionControl


def after(*triggers):
    """Phases that a session announces, and its control."""
    phases = []
    control = SessionControl(lambda state: phases.append(state.phase))
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
    assert [new.number for new in control.take_inputs()] == [8, 9, 10, 11]
    assert control.take_inputs() == () and control.state.input == 11
    assert control.state.reason == "disconnected"


def test_start_pauses_and_blurs_are_noted_in_order_with_their_time():
    _, control = after(Trigger.OPENED, Trigger.RUN, Trigger.PAUSE)
    control.note("blur", away=True)
    control.apply(Trigger.RUN)
    notes = control.take_notes()
    assert [event for event, _ in notes] == ["started", "pause", "blur", "resume"]
    assert all(fields["wall"] > 0.0 for _, fields in notes) and control.take_notes() == []
