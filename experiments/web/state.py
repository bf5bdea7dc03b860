"""States of a session with a person, the table of their transitions, and the messages that describe a state.

The worker owns the state. Server and page hold copies of what it sends.
"""

from collections.abc import Mapping
from enum import StrEnum, auto

import msgspec

from hud.state import HudState, Marker, MiniMap, Pointer


class SessionPhase(StrEnum):
    """State of a session. Its clock only advances while it is running."""

    LOADING = auto()
    READY = auto()
    RUNNING = auto()
    PAUSED = auto()
    OVER = auto()
    FAILED = auto()


class Trigger(StrEnum):
    """Cause of a transition."""

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
}  # other triggers have no effect


class WireMessage(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type", tag=str.lower):
    """A message. Its `type` is its tag, by default the lower-case name of its class."""


class State(WireMessage, frozen=True):
    """State of the session, the reason if it is paused, over or failed, and the number of the last received input."""

    phase: SessionPhase = LOADING
    reason: str = ""
    input: int = 0

    def after(self, trigger: Trigger, reason: str = "") -> "State":
        """Return the next state, or the same object if the trigger has no effect."""
        phase = TRANSITIONS.get((self.phase, trigger))
        return self if phase is None else State(phase, reason, self.input)


class GaitParameters(msgspec.Struct, frozen=True):
    """Limits and servos of walking in SI units, the fields of `mjsim.world.fidelity.kinematics.Gait`."""

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
    """Speeds of the person at full deflection of the controls, in m/s and rad/s."""

    walking_speed: float
    turning_speed: float
    looking_speed: float


class SceneMessage(WireMessage, frozen=True, tag="scene"):
    """Scene for clients that draw, sent once.

    Attributes:
        path: URL path of the scene's files on this server. If None, the server draws.
        floor: File of the obstacles for `gait`, or None if walking cannot be predicted.
        field_of_view: Horizontal field of view for any shape of the view, in radians.
        field_of_view_range: Limits of the person's choice of the field of view, or None.
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
    """State at the start of a control step for clients that draw, sent once per step.

    Attributes:
        step: Control step that starts with this state.
        input: Number of the last input that has taken effect.
        body: Position, speeds, commands and servos of the body (docs/protocol.md).
        eye: Position in metres, heading and pitch in radians.
        hands: Positions of the left and right hand in the body's frame, in metres.
        held: Instance names of the objects in the hands.
        objects: Position in metres (3) and orientation wxyz (4) by instance name, if changed since the last snapshot.
        models: Models by instance name, of objects that are new to the client or were `gone`.
        gone: Instance names of objects without further updates.
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
    """Markers of the HUD for clients that draw, sent when they change."""

    markers: tuple[Marker, ...]


class Pictures(WireMessage, frozen=True):
    """Pictures named by a `hud`, as data URLs by key. Sent once per page."""

    pictures: dict[str, str]


class Hud(WireMessage, frozen=True):
    """State of the HUD, without its markers and without the values that a `moment` has."""

    state: HudState


class Reach(msgspec.Struct, frozen=True):
    """Effect of the action key: the object, and the receptacle if the object would be placed.

    `instance` is the object's instance name. `place` is the position of the object or the receptacle in metres. `at` is
    that position in the view, as shares of its width and height, or None if it is out of view.
    """

    object: str
    receptacle: str | None
    at: tuple[float, float] | None
    instance: str
    place: tuple[float, float, float]


class Moment(WireMessage, frozen=True):
    """Values that change as the person moves: clock in whole seconds, room, object in reach, pointer and map."""

    step: int
    clock: float | None
    room: str
    reach: Reach | None
    pointer: Pointer | None
    minimap: MiniMap | None


class Busy(WireMessage, frozen=True):
    """Start or end of a pick or place, for clients that show frames. Keys pressed during it are handled afterwards."""

    busy: bool
