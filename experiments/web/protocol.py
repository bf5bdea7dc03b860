"""The messages between browser, server and worker (docs/protocol.md).

A message is an object whose `type` is the name of its class in lower case. Between browser and server messages are JSON
except for frames, which are binary; between server and worker they are MessagePack. The server forwards most of them.
"""

import struct
from typing import Annotated, Any, Literal

import msgspec

from experiments.web.controls import Input
from experiments.web.state import LOADING, TRANSITIONS, SessionPhase, Trigger
from hud.state import HudState, Marker, MiniMap, Pointer

HOUSE = "MJSIM_PLAY_HOUSE"  # environment variable that tells the fork server the house of most sessions
VERSION = 1  # of the head of a frame
MAX_TEXT = 64 * 1024  # bytes of a message from the browser
MAX_INPUTS = 64  # of one message
FRAME_HEAD = struct.Struct("<BBBBHHIIQf")
LENGTH = struct.Struct("!I")  # in bytes, of a message between server and worker
CODECS = {"jpeg": 1, "h264": 2}
BEAT_PERIOD = 0.5  # s between two signs of life, both ways
MAX_SILENCE = 1.0  # s without a message after which the link counts as lost
MAX_STEPS_AHEAD = 25  # control steps by which inputs and promises may be ahead of the last one taken: 1 s
DISPLAY_PERIOD = 5.0  # s between two messages `display`
KEY_FLAG = 1
REFUSED, REPLACED, IDLE, TOO_MUCH, SLOW = 4000, 4001, 4002, 4003, 4004  # codes with which the server closes

Codec = Literal["jpeg", "h264", "none"]
Drawer = Literal["browser", "server"]  # who draws the picture
PauseReason = Literal["asked", "hidden", "disconnected", "silent", "restarted", "taken over"]
ErrorCode = Literal["malformed", "too early", "out of order", "too much", "idle"]
Length = Annotated[int, msgspec.Meta(ge=1, le=8192)]  # px
Count = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
Angle = Annotated[float, msgspec.Meta(gt=0.0, lt=3.0)]  # rad, horizontal, of a view
Measured = Annotated[float, msgspec.Meta(ge=0.0, le=1e6)]


class WireMessage(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type", tag=str.lower):
    """A message; `type` is the name of its class in lower case."""


class View(WireMessage, frozen=True):
    """How a page wants to see the session: size in px, and how frames are compressed; `none` where it draws itself.

    `field_of_view` is what the person chose; it counts within the `field_of_view_range` of the scene.
    """

    width: Length
    height: Length
    codec: Codec = "jpeg"
    field_of_view: Angle | None = None


class Hello(WireMessage, frozen=True):
    """First message of a connection: a random name of the page, which may reconnect, its trial and its view."""

    tab: Annotated[str, msgspec.Meta(pattern="^[A-Za-z0-9-]{8,64}$")]
    trial: Annotated[str, msgspec.Meta(max_length=20)]
    view: View


class TakeOver(WireMessage, frozen=True):
    """Continue here with a session that is open in another page; the answer to `occupied`."""


class Run(WireMessage, frozen=True):
    """Start the clock, or let it run again; a page that will promise its inputs promises here what it has, or 0."""

    until: Count | None = None


class Inputs(WireMessage, frozen=True):
    """What the person pressed, in order, each once.

    `until` promises that all inputs for the control steps before it have been sent; the clock then waits for such
    promises, for 0.75 s at most.
    """

    inputs: Annotated[list[Input], msgspec.Meta(max_length=MAX_INPUTS)]
    until: Count | None = None


class Seen(WireMessage, frozen=True):
    """The browser has shown a frame, by its number."""

    frame: Count


class Beat(WireMessage, frozen=True):
    """A sign of life: the server sends one twice a second, and the page sends one back.

    After 1 s without any message from the page the clock is stopped.
    """


class Display(WireMessage, frozen=True):
    """How well the person saw the session in the last 5 s; this is only logged.

    `draw` is who drew, and `renderer` what drew, in words; `width` and `height` are those of the view, px of the page,
    and `pixel_ratio` is how many px of the screen one of them has. `frames_per_s` counts the pictures that were shown,
    `frame_ms` and `frame_ms_95` are median and 95 % of the times between two of them, `latency_ms` the median from an
    input to the picture that shows it, or, where the browser draws, to the state of the server that counts it, absent
    where nothing was pressed, and `dropped` counts the pictures that came and were not shown. `field_of_view` is that
    of the picture where the person may choose it.
    """

    draw: Drawer
    renderer: Annotated[str, msgspec.Meta(max_length=200)]
    width: Length
    height: Length
    pixel_ratio: Annotated[float, msgspec.Meta(gt=0.0, le=100.0)]
    frames_per_s: Measured
    frame_ms: Measured
    frame_ms_95: Measured
    dropped: Count
    latency_ms: Measured | None = None
    field_of_view: Angle | None = None


class Draw(WireMessage, frozen=True):
    """Who draws from now on, and why no longer the other one; this is only logged."""

    draw: Drawer
    reason: Annotated[str, msgspec.Meta(max_length=200)]


class Pause(WireMessage, frozen=True):
    """Stop the clock; the reason is logged."""

    reason: PauseReason


class Blur(WireMessage, frozen=True):
    """The page lost the keyboard to another window, or got it back; this is only logged."""

    away: bool


class Leave(WireMessage, frozen=True):
    """End the trial now."""


class Open(WireMessage, frozen=True):
    """Open a session in a worker: its journal's folder, its run directory, settings, earlier phases of the visit.

    `restarted` tells that the worker before has died, `as_inputs_come` that control steps are taken as soon as their
    inputs are promised, faster than real time, as in a rehearsal, and `floor_plan` that one of the task is drawn.
    `language` is that of the labels and of the HUD, whose words `texts` replaces if it is not empty.
    """

    folder: str
    run: str
    config: dict[str, Any]
    before: list[dict[str, Any]] = []
    restarted: bool = False
    as_inputs_come: bool = False
    floor_plan: bool = True
    language: str = "en"
    texts: dict[str, str] = {}


class State(WireMessage, frozen=True):
    """The state of the session, why it is paused, over or failed, and the number of the last input that it received."""

    phase: SessionPhase = LOADING
    reason: str = ""
    input: int = 0

    def after(self, trigger: Trigger, reason: str = "") -> "State":
        """The state that follows, or the same object where the trigger changes nothing."""
        phase = TRANSITIONS.get((self.phase, trigger))
        return self if phase is None else State(phase, reason, self.input)


class Taken(WireMessage, frozen=True):
    """Everything up to this input and control step counts, and is safe on the disk."""

    input: int
    step: int


class Frame(WireMessage, frozen=True):
    """A frame of a view, by number from 1: the start of a control step, the last input that counts, and the picture.

    H.264 is in Annex B, one access unit; `key` frames can be decoded without earlier ones. `milliseconds` is the time
    to draw and compress it.
    """

    number: int
    step: int
    input: int
    codec: Codec
    key: bool
    width: int
    height: int
    milliseconds: float
    data: bytes

    def packed(self) -> bytes:
        codec, key = CODECS[self.codec], KEY_FLAG if self.key else 0
        head = (VERSION, codec, key, 0, self.width, self.height, self.number, self.step, self.input)
        return FRAME_HEAD.pack(*head, self.milliseconds) + self.data


class Gait(msgspec.Struct, frozen=True):
    """Limits and servos of walking, as the field of `mjsim.world.fidelity.kinematics.Gait`; SI units."""

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
    """Speeds of the person at full deflection of the controls, m/s and rad/s."""

    walking_speed: float
    turning_speed: float
    looking_speed: float


class Scene(WireMessage, frozen=True):
    """What a client that draws needs once: where the files of the scene are, and how the person moves.

    `path` is the folder of the scene's files on this server, None where it has none: then the server has to draw.
    `floor` is the file of the obstacles for `gait`, or None where walking cannot be predicted. `field_of_view` is
    horizontal, rad, whatever the shape of the view; `field_of_view_range` is within which angles the person may choose
    it, None without a choice. `step_duration` is that of a control step, s.
    """

    path: str | None
    floor: str | None
    gait: Gait
    speeds: Speeds
    field_of_view: float
    field_of_view_range: tuple[float, float] | None
    step_duration: float


class Snapshot(WireMessage, frozen=True):
    """The state at the start of a control step, for clients that draw; once a step.

    Attributes:
        step: The control step that begins with this state.
        input: Number of the last input that counts in it.
        time: Simulated time, s.
        busy: Whether a pick or place is under way.
        body: Position, speeds, commands and servos of the body (docs/protocol.md).
        eye: Position, m, heading and pitch, rad.
        hands: Positions of the left and the right hand in the body's frame, m.
        held: What they hold, by instance name.
        objects: Position (3), m, and orientation wxyz (4) by instance name, where they changed since the last snapshot.
        models: Model by instance name, of objects that the client has not seen, or not since they were `gone`.
        gone: Instance names of objects about which the client is told nothing any more.
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
    """The markers of the HUD, for clients that draw; when they change."""

    markers: tuple[Marker, ...]


class Pictures(WireMessage, frozen=True):
    """The pictures that a `hud` names, as data URLs, by their keys; sent once to a page."""

    pictures: dict[str, str]


class Hud(WireMessage, frozen=True):
    """What is shown beside the picture: the state of the HUD without its markers, and without what a `moment` has."""

    state: HudState


class Reach(msgspec.Struct, frozen=True):
    """What the action key would do: the object, the receptacle if it is put there, and where that is.

    `instance` is the object's instance name, `place` the position of the object or the receptacle, m, and `at` where
    that is in the view, in shares of its width and height, or None where it is out of view.
    """

    object: str
    receptacle: str | None
    at: tuple[float, float] | None
    instance: str
    place: tuple[float, float, float]


class Moment(WireMessage, frozen=True):
    """What changes as the person moves: the clock in whole seconds, the room, what is in reach, pointer and map."""

    step: int
    clock: float | None
    room: str
    reach: Reach | None
    pointer: Pointer | None
    minimap: MiniMap | None


class Busy(WireMessage, frozen=True):
    """Whether a pick or place is under way, for clients that show frames; keys pressed then are handled afterwards."""

    busy: bool


class Saved(WireMessage, frozen=True):
    """The run directory of a session that is over has been written."""


class Queue(WireMessage, frozen=True):
    """All slots are taken. The page has to be loaded again, and then shows the queue."""


class Occupied(WireMessage, frozen=True):
    """The session is open in another page; `takeover` continues here."""


class Replaced(WireMessage, frozen=True):
    """Another page took the session over; this connection is closed."""


class Error(WireMessage, frozen=True):
    """A message was refused and does not count: a code, and the reason in words."""

    code: ErrorCode
    message: str


FromBrowser = Hello | TakeOver | Run | Inputs | View | Seen | Beat | Display | Draw | Pause | Blur | Leave
ToBrowser = (
    State
    | Taken
    | Scene
    | Snapshot
    | Markers
    | Pictures
    | Hud
    | Moment
    | Busy
    | Beat
    | Saved
    | Queue
    | Occupied
    | Replaced
    | Error
)
ToWorker = Open | Run | Inputs | View | Seen | Beat | Display | Draw | Pause | Blur | Leave
FromWorker = State | Taken | Frame | Scene | Snapshot | Markers | Pictures | Hud | Moment | Busy | Saved

decode_from_browser: Any = msgspec.json.Decoder(FromBrowser).decode
encode_to_browser = msgspec.json.Encoder().encode
decode_to_worker: Any = msgspec.msgpack.Decoder(ToWorker).decode
decode_from_worker: Any = msgspec.msgpack.Decoder(FromWorker).decode
_encode = msgspec.msgpack.Encoder().encode


def packed(message: WireMessage) -> bytes:
    """A message between server and worker, after its length."""
    content = _encode(message)
    return LENGTH.pack(len(content)) + content
