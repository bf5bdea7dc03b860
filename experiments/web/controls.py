"""From inputs of a person to the action of a control step.

A control step takes all inputs since the step before, so that a tap between two steps counts. The mouse sets a target
angle that body and head follow within their limits.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import msgspec

from mjsim.values.actions import Action, ActionResult, Move, Pick, Place, Refusal
from mjsim.values.observation import Observation
from mjsim.values.person_parameters import PersonParameters

Share = Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)]  # of the highest speed
Angle = Annotated[float, msgspec.Meta(ge=-7.0, le=7.0)]  # rad
Press = Literal["act", "left hand", "right hand"]
MAX_PITCH = 1.2  # rad that the mouse can look up or down
MAX_PRESSES = 8  # that wait
PRESS_LIFE = 0.5  # s after which a press that was not handled is forgotten
MAX_TURN_AHEAD = 2.8  # rad that the mouse can be ahead of the body


class Input(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A change at the keyboard, the mouse, a gamepad or a touch screen."""

    # 1 for the first input of a session, then one more each
    number: Annotated[int, msgspec.Meta(ge=1, le=2**53)]
    # the control step at which it counts, or the next one if that is over; None for the next one
    step: Annotated[int, msgspec.Meta(ge=0, le=2**53)] | None = None
    forward: Share = 0.0  # walking from now on: share of the speed, negative to walk back
    left: Share = 0.0  # stepping to the left from now on
    turn: Share = 0.0  # turning to the left from now on
    look: Share = 0.0  # looking up from now on
    yaw: Angle = 0.0  # added to the heading to turn to, rad, counter-clockwise
    pitch: Angle = 0.0  # added to the pitch to look to, rad, upwards
    press: Press | None = None  # the action key, or the key of a hand, was pressed
    # rows by which the task list is scrolled, positive towards its end
    scroll: Annotated[int, msgspec.Meta(ge=-100, le=100)] = 0

    def at_rest(self) -> "Input":
        """What of it counts while the clock is paused: nothing is held, turned or pressed then."""
        return Input(number=self.number, scroll=self.scroll)


Answer = Callable[[Pick | Place], ActionResult]


@dataclass(frozen=True)
class Controls:
    """The latest input, where the mouse points (rad; None if it does not), and waiting presses with their age, s."""

    held: Input | None = None
    heading: float | None = None
    pitch: float | None = None
    presses: tuple[tuple[Press, float], ...] = ()

    def take(self, inputs: Sequence[Input], seen: Observation) -> "Controls":
        """The controls after further inputs."""
        heading, pitch = self.heading, self.pitch
        for new in inputs:
            if new.yaw:
                ahead = 0.0 if heading is None else _gap(heading, seen.heading)
                heading = seen.heading + min(max(ahead + new.yaw, -MAX_TURN_AHEAD), MAX_TURN_AHEAD)
            if new.pitch:
                pitch = (seen.pitch if pitch is None else pitch) + new.pitch
                pitch = min(max(pitch, -MAX_PITCH), MAX_PITCH)
            heading = None if new.turn else heading
            pitch = None if new.look else pitch
        presses = (*self.presses, *((new.press, 0.0) for new in inputs if new.press is not None))
        return Controls(inputs[-1] if inputs else self.held, heading, pitch, presses[:MAX_PRESSES])


def control_step(
    before: Controls,
    inputs: Sequence[Input],
    seen: Observation,
    answer: Answer,
    person: PersonParameters,
    duration: float,
) -> tuple[Action, Controls]:
    """The action of a control step of `duration` seconds, and the controls after it.

    The action key places an object that belongs into a receptacle in reach; else it picks the nearest object in reach.
    The key of a hand places the object in that hand; if it is empty, it picks. The impossible is attempted, so that the
    message bar gives the reason; `answer` is the world's answer to a pick or place.
    """
    controls = before.take(inputs, seen)
    if not controls.presses:
        return _move(controls, inputs, seen, person, duration), controls
    (press, _), *later = controls.presses
    aged = tuple((new, age + duration) for new, age in later if age + duration <= PRESS_LIFE)
    return _attempt(press, seen, answer), replace(controls, presses=aged)


def _attempt(press: Press, seen: Observation, answer: Answer) -> Action:
    if press != "act":
        held = seen.hands[0 if press == "left hand" else 1]
        return Pick() if held is None else Place(held)
    return act(answer)


def act(answer: Answer) -> Pick | Place:
    """What the action key attempts; `answer` is the world's answer to a pick or place."""
    place = answer(Place())
    at_another_receptacle = place.refusal is Refusal.NOT_THE_RECEPTACLE
    if place.applied or (at_another_receptacle and not answer(Pick()).applied):
        return Place()
    return Pick()


def _move(
    controls: Controls, inputs: Sequence[Input], seen: Observation, person: PersonParameters, duration: float
) -> Move:
    """The fastest walk that was asked for since the last step, and the turn towards where the mouse points."""
    asked = inputs if controls.held is None else (*inputs, controls.held)

    def fastest(name: str) -> float:
        return max((float(getattr(new, name)) for new in asked), key=abs, default=0.0)

    forward, left = fastest("forward"), fastest("left")
    speed = person.walking_speed / max(1.0, math.hypot(forward, left))  # walking diagonally is not faster
    turn, look = fastest("turn") * person.turning_speed, fastest("look") * person.looking_speed
    if controls.heading is not None and not turn:
        turn = _rate(_gap(controls.heading, seen.heading) / duration, person.turning_speed)
    if controls.pitch is not None and not look:
        look = _rate((controls.pitch - seen.pitch) / duration, person.looking_speed)
    return Move(forward * speed, left * speed, turn, look)


def _gap(angle: float, start: float) -> float:
    """The shorter turn from one heading to another, rad."""
    return (angle - start + math.pi) % (2.0 * math.pi) - math.pi


def _rate(rate: float, limit: float) -> float:
    return min(max(rate, -limit), limit)
