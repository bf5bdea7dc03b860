"""Convert a participant's inputs to one action per control step.

A control step handles all inputs since the previous step, so that even a short tap between two steps has an
effect. The mouse sets target angles, which the body and head follow within their speed limits.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import msgspec

from mjsim.values.actions import Action, ActionResult, Move, Pick, Place, Refusal
from mjsim.values.observation import Observation
from mjsim.values.person_parameters import PersonParameters

Share = Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)]  # speed as a fraction of the maximum speed
Angle = Annotated[float, msgspec.Meta(ge=-7.0, le=7.0)]  # angle in radians
Press = Literal["act", "left hand", "right hand"]
MAX_PITCH = 1.2  # maximum pitch that can be set with the mouse, in radians
MAX_PRESSES = 8  # maximum number of queued key presses
PRESS_LIFE = 0.5  # time after which a queued key press is dropped, in seconds
MAX_TURN_AHEAD = 2.8  # maximum angle between the body and the mouse's target heading, in radians


class Input(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An input event from the keyboard, mouse, gamepad or touch screen."""

    # Number of the input, counted from 1
    number: Annotated[int, msgspec.Meta(ge=1, le=2**53)]
    # Control step in which the input takes effect. If it is None or in the past, the next step is used.
    step: Annotated[int, msgspec.Meta(ge=0, le=2**53)] | None = None
    forward: Share = 0.0  # forward walking speed; negative values mean walking backwards
    left: Share = 0.0  # sideways walking speed, positive to the left
    turn: Share = 0.0  # turning speed of the body, positive to the left
    look: Share = 0.0  # pitch speed of the head, positive upwards
    yaw: Angle = 0.0  # change of the target heading in radians, positive counter-clockwise
    pitch: Angle = 0.0  # change of the target pitch in radians, positive upwards
    press: Press | None = None  # key that was pressed, which is either the action key or the key for a hand
    # Number of rows by which the task list is scrolled, positive towards the end
    scroll: Annotated[int, msgspec.Meta(ge=-100, le=100)] = 0

    def at_rest(self) -> "Input":
        """Return a copy that contains only the inputs that also work while the clock is paused."""
        return Input(number=self.number, scroll=self.scroll)


Answer = Callable[[Pick | Place], ActionResult]


@dataclass(frozen=True)
class Controls:
    """The latest input, the target angles of the mouse in radians, and queued key presses with ages in seconds."""

    held: Input | None = None
    heading: float | None = None
    pitch: float | None = None
    presses: tuple[tuple[Press, float], ...] = ()

    def take(self, inputs: Sequence[Input], seen: Observation) -> "Controls":
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
    """Return the action of a control step that lasts `duration` seconds, and the updated controls.

    The action key places a held object if its receptacle is within reach. Otherwise it picks up the nearest object
    within reach. The key of a hand places the object in that hand, or picks up an object if the hand is empty.
    Impossible actions are attempted as well, so that the message bar can explain why they fail. The function
    `answer` returns the result that a pick or place would have.
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
    """Return a place action if an object can be placed, otherwise a pick action."""
    place = answer(Place())
    at_another_receptacle = place.refusal is Refusal.NOT_THE_RECEPTACLE
    if place.applied or (at_another_receptacle and not answer(Pick()).applied):
        return Place()
    return Pick()


def _move(
    controls: Controls, inputs: Sequence[Input], seen: Observation, person: PersonParameters, duration: float
) -> Move:
    """Combine all inputs since the previous step into one move, using the highest requested speeds."""
    asked = inputs if controls.held is None else (*inputs, controls.held)

    def fastest(name: str) -> float:
        return max((float(getattr(new, name)) for new in asked), key=abs, default=0.0)

    forward, left = fastest("forward"), fastest("left")
    speed = person.walking_speed / max(1.0, math.hypot(forward, left))  # also limits the diagonal speed
    turn, look = fastest("turn") * person.turning_speed, fastest("look") * person.looking_speed
    if controls.heading is not None and not turn:
        turn = _rate(_gap(controls.heading, seen.heading) / duration, person.turning_speed)
    if controls.pitch is not None and not look:
        look = _rate((controls.pitch - seen.pitch) / duration, person.looking_speed)
    return Move(forward * speed, left * speed, turn, look)


def _gap(angle: float, start: float) -> float:
    return (angle - start + math.pi) % (2.0 * math.pi) - math.pi


def _rate(rate: float, limit: float) -> float:
    return min(max(rate, -limit), limit)
