"""Collect the events and plans that the page of a run shows on its timeline."""

from collections.abc import Callable, Mapping
from typing import Any

from experiments.house import House
from experiments.record.reader import Record
from experiments.record.records import Event
from experiments.trials.floor_plan import planned_path

Words = Callable[[Event], str]
DONE = {"pick": "in the hand", "place": "in its bin"}


def moments(record: Record, house: House) -> list[dict[str, Any]]:
    """Return the timeline's events, each with a time `t` in seconds, a `kind` as in the log, and a `text`."""
    words = _words(record, house)
    return [
        {"t": event["t"], "kind": event["event"], "text": words[event["event"]](event)}
        for event in record.events
        if event["event"] in words and not (event["event"] == "attempt" and event["applied"])
    ]


def plans(record: Record, house: House) -> list[dict[str, Any]]:
    """Return all plans. Each has a time `t` in seconds and a `path`, a flat list of coordinates in metres."""
    found = []
    for event, step in zip(record.events, record.steps_of_events, strict=True):
        if event["event"] == "plan":
            path = planned_path(house, record.episode, event, record.observation(step))
            found.append(
                {
                    "t": event["t"],
                    "cost_m": round(event["cost_m"], 2),
                    "status": event["status"],
                    "path": path.round(3).ravel().tolist(),
                }
            )
    return found


def _words(record: Record, house: House) -> Mapping[str, Words]:
    labels = {placed.name: house.catalogue.objects[placed.model].label for placed in record.episode.objects}

    def of(event: Event) -> str:
        return labels.get(event.get("object") or "", "nothing")

    def plan(event: Event) -> str:
        kind = "better plan" if event.get("improved") else "plan"
        return f"{kind}: {event['cost_m']:.1f} m, {event['status']}"

    def visit(event: Event) -> str:
        regret = event.get("regret_m")
        text = f"{of(event)}: {DONE[event['kind']]}{', not as suggested' if event['deviated'] else ''}"
        return f"{text}, {regret:.2f} m longer than the best" if regret else text

    def outcome(what: str) -> Words:
        return lambda event: f"{of(event)}: {what}"

    happened = {
        "pick_failed": "not picked",
        "place_failed": "not placed",
        "grip_lost": "lost from the hand",
        "dislodged": "pushed",
        "ejected": "ejected",
        "tunnelled": "tunnelled",
    }
    return {
        **{kind: outcome(what) for kind, what in happened.items()},
        "plan": plan,
        "visit": visit,
        "attempt": lambda event: f"{event['action']} of {of(event)} refused: {event['refusal']}",
        "pause": lambda event: f"paused: {event['reason']}",
        "resume": lambda _: "continued",
        "end": lambda event: f"end: {event['reason']}",
    }
