"""The events of a record, for a session that repeats it."""

from collections.abc import Sequence

from experiments.record.records import Event
from experiments.session.assistant import Assistant
from mjsim.values.actions import EventKind, WorldEvent
from mjsim.values.observation import Observation

WORLD_EVENTS = {kind.value: kind for kind in EventKind}
# that come from outside of the simulation
EXTERNAL_EVENTS = ("scroll", "overrun", "started", "pause", "resume", "blur", "display", "draw")


def catch_up(assistant: Assistant, observation: Observation, events: Sequence[Event]) -> None:
    """Tell an assistant of a recorded control step, which led to this state, and of the events in it."""
    for event in events:
        if event["event"] == "attempt" and event["refusal"] is not None:
            assistant.show_message(event["refusal"], observation.time, event["object"])
    happened = [
        WorldEvent(float(e["t"]), WORLD_EVENTS[e["event"]], e["object"], e["receptacle"])
        for e in events
        if e["event"] in WORLD_EVENTS
    ]
    assistant.observe(observation, happened)
    for event in events:
        if event["event"] == "scroll":
            assistant.scroll(int(event["rows"]))
