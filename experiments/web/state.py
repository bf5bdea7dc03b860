"""States of a live session, the transitions between them, and the messages that describe a state.

The worker owns the state. The server and the page keep copies.
"""

from collections.abc import Mapping
from enum import StrEnum, auto

import msgspec

from hud.state import HudState, Marker, MiniMap, Pointer


class SessionPhase(StrEnum):
    """The phase of a live session. The clock only advances in the phase `RUNNING`."""

    LOADING = auto()
    READY = auto()
    RUNNING = auto()
    PAUSED = auto()
    OVER = auto()
    FAILED = auto()


class Trigger(StrEnum):
    """An event that can change the phase of a live session."""

    OPENED = auto()
    RESTORED = auto()
    RUN = auto()
    PAUSE = auto()
    END = auto()
    FAIL = auto()


LOADING, READY, RUNNING, PAUSED, OVER, FAILED = SessionPhase
TRANSITIONS: Mapping[tuple[SessionPhase, Trigger], SessionPhase] = {
    (LOADING, Trigger.OPENED): READY,
    (LOADING, Trigger.RESTORED): PAUSED,
    (READY, Trigger.RUN): RUNNING,
    (PAUSED, Trigger.RUN): RUNNING,
    (RUNNING, Trigger.PAUSE): PAUSED,
    **{(phase, Trigger.END): OVER for phase in (LOADING, READY, RUNNING, PAUSED)},
    **{(phase, Trigger.FAIL): FAILED for phase in (LOADING, READY, RUNNING, PAUSED, OVER)},
}  # all other combinations have no effect


class WireMessage(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type", tag=str.lower):
    """The base class of messages. A message's `type` is its tag, by default its class name in lower case."""


class State(WireMessage, frozen=True):
    """The state of a session. `reason` explains a pause, end or failure. `input` numbers the last input."""

    phase: SessionPhase = LOADING
    reason: str = ""
    input: int = 0

    def after(self, trigger: Trigger, reason: str = "") -> "State":
        """Return the state after a trigger, or this state if the trigger has no effect."""
        phase = TRANSITIONS.get((self.phase, trigger))
        return self if phase is None else State(phase, reason, self.input)


class GaitParameters(msgspec.Struct, frozen=True):
    """Walking parameters in SI units, with the same fields as `mjsim.world.fidelity.kinematics.Gait`."""

    max_speed: float
    max_turn: float
    max_look: float
    acceleration: float
    turn_acceleration: float
    dt: float
    substeps: int
    mass: float
    walk_gain: float
    walk_force: float
    inertia: float
    turn_gain: float
    turn_force: float
    head_inertia: float
    head_stiffness: float
    head_damping: float
    head_force: float
    lowest: float
    highest: float
    radius: float
    eye_height: float
    eye_forward: float


class Speeds(msgspec.Struct, frozen=True):
    """The participant's speeds at full deflection of the controls, in m/s and rad/s."""

    walking_speed: float
    turning_speed: float
    looking_speed: float


class SceneMessage(WireMessage, frozen=True, tag="scene"):
    """The scene that the client draws. It is sent once.

    Attributes:
        path: URL path of the scene's files, or None if the server draws.
        floor: URL path of the file with obstacles, or None if the client cannot predict walking.
        field_of_view: Horizontal field of view in radians, which does not depend on the aspect ratio.
        field_of_view_range: Smallest and largest field of view that the participant may choose, or None.
        step_duration: Duration of a control step, in seconds.
    """

    path: str | None
    floor: str | None
    gait: GaitParameters
    speeds: Speeds
    field_of_view: float
    field_of_view_range: tuple[float, float] | None
    step_duration: float


class Snapshot(WireMessage, frozen=True):
    """The state at the start of a control step. One snapshot per step is sent to clients that draw the view.

    Attributes:
        step: Control step that starts with this state.
        input: Number of the last input that has taken effect.
        body: Positions, speeds, commands and servo states of the body (docs/protocol.md).
        eye: Position of the eyes in metres, heading and pitch in radians.
        hands: Positions of the left and right hand in the body's frame, in metres.
        held: Instance names of the held objects.
        objects: Positions in metres (3) and quaternions wxyz (4) of objects that moved since the last snapshot, by
            instance name.
        models: Models of objects that are new to the client or were `gone`, by instance name.
        gone: Instance names of objects for which no further updates are sent.
    """

    step: int
    input: int
    time: float
    busy: bool
    body: list[float]
    eye: list[float]
    hands: list[list[float]]
    held: tuple[str | None, str | None]
    objects: dict[str, list[float]]
    models: dict[str, str]
    gone: list[str]


class Markers(WireMessage, frozen=True):
    """The markers of the HUD. They are sent to clients that draw the view whenever they change."""

    markers: tuple[Marker, ...]


class Pictures(WireMessage, frozen=True):
    """The pictures that `hud` messages refer to, which are sent once to each page. Keys map to data URLs.

    `example` has the labels of an object and its receptacle, by key. It is the same in all conditions. `markers` has
    the roles of the markers in the picture `markers`, if the study explains them and the condition shows any.
    """

    pictures: dict[str, str]
    example: dict[str, str]
    markers: tuple[str, ...] = ()


class Hud(WireMessage, frozen=True):
    """The state of the HUD, except for the markers and the values in `moment` messages."""

    state: HudState


class Reach(msgspec.Struct, frozen=True):
    """The object that the action key would pick up or place, and the receptacle in which it would be placed.

    In a condition without markers, an object that has not been in the picture yet is not reported, because its
    label would reveal it.
    `instance` is the object's instance name. `place` is the position of the object or receptacle in metres.
    `at` is this position in the view, as fractions of its width and height, or None if it is not visible.
    """

    object: str
    receptacle: str | None
    at: tuple[float, float] | None
    instance: str
    place: tuple[float, float, float]


class Moment(WireMessage, frozen=True):
    """HUD values that change often: clock in whole seconds, room, object within reach, pointer and map."""

    step: int
    clock: float | None
    room: str
    reach: Reach | None
    pointer: Pointer | None
    minimap: MiniMap | None


class Busy(WireMessage, frozen=True):
    """A notice that a pick or place has started or ended. It is only sent to clients that show frames."""

    busy: bool
