"""Messages between browser, server and worker (docs/protocol.md).

Each message is an object with a field `type`, which contains the tag of its class. Browser and server
exchange JSON and binary frames. Server and worker exchange MessagePack. The server forwards most messages.
"""

import struct
from typing import Annotated, Any, Literal

import msgspec

from experiments.web.controls import Input
from experiments.web.state import (
    Busy,
    Hud,
    Markers,
    Moment,
    Pictures,
    SceneMessage,
    Snapshot,
    State,
    WireMessage,
)

HOUSE = "MJSIM_PLAY_HOUSE"  # environment variable with the name of the house to preload
VERSION = 1  # version number of the frame header
MAX_TEXT = 64 * 1024  # maximum size of a message from a browser, in bytes
MAX_INPUTS = 64  # maximum number of inputs in a message
FRAME_HEAD = struct.Struct("<BBBBHHIIQf")
LENGTH = struct.Struct("!I")  # length prefix of a message between server and worker
CODECS = {"jpeg": 1, "h264": 2}
BEAT_PERIOD = 0.5  # interval between heartbeats, in seconds
MAX_SILENCE = 1.0  # time without a message after which the connection counts as lost, in seconds
MAX_STEPS_AHEAD = 25  # maximum lead of a client's messages over the clock, in control steps
DISPLAY_PERIOD = 5.0  # interval between `display` messages, in seconds
KEY_FLAG = 1
REFUSED, REPLACED, IDLE, TOO_MUCH, SLOW = 4000, 4001, 4002, 4003, 4004  # WebSocket close codes

Codec = Literal["jpeg", "h264", "none"]
Drawer = Literal["browser", "server"]  # program that renders the participant's view
PauseReason = Literal["asked", "hidden", "disconnected", "silent", "restarted", "taken over", "picture lost"]
ErrorCode = Literal["malformed", "too early", "out of order", "too much", "idle"]
Length = Annotated[int, msgspec.Meta(ge=1, le=8192)]  # length in pixels
Count = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
Angle = Annotated[float, msgspec.Meta(gt=0.0, lt=3.0)]  # horizontal field of view, in radians
Measured = Annotated[float, msgspec.Meta(ge=0.0, le=1e6)]


class View(WireMessage, frozen=True):
    """A request for a view of this size in CSS pixels. The codec is `none` if the page itself draws the view.

    `field_of_view` is chosen by the participant, within the `field_of_view_range` of the scene.
    """

    width: Length
    height: Length
    codec: Codec = "jpeg"
    field_of_view: Angle | None = None


class Hello(WireMessage, frozen=True):
    """The first message of a connection. `tab` is a random name that the page keeps when it reconnects."""

    tab: Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9-]{8,64}\Z")]
    trial: Annotated[str, msgspec.Meta(max_length=20)]
    view: View


class TakeOver(WireMessage, frozen=True):
    """A request to continue a session that is open on another page. Clients send it after an `occupied` message."""


class RunMessage(WireMessage, frozen=True, tag="run"):
    """A request to start or resume the clock. `until` is the first promise (see `Inputs`), or None."""

    until: Count | None = None


class Inputs(WireMessage, frozen=True):
    """The participant's inputs in chronological order. Each input is sent only once.

    By setting `until`, the page promises that it has sent all inputs for earlier control steps. The clock
    then waits up to 0.75 s for each further promise.
    """

    inputs: Annotated[list[Input], msgspec.Meta(max_length=MAX_INPUTS)]
    until: Count | None = None


class Seen(WireMessage, frozen=True):
    """An acknowledgement that the browser has shown the frame with this number."""

    frame: Count


class Beat(WireMessage, frozen=True):
    """A heartbeat. The server sends two per second, and the page answers each of them.

    If the page sends no message for 1 s, the clock stops.
    """


class Display(WireMessage, frozen=True):
    """A report on the display quality over the last 5 s, which is written to the log as a `DisplayEvent`."""

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
    """A notice that says whether the browser or the server now draws the view. It is logged with the reason."""

    draw: Drawer
    reason: Annotated[str, msgspec.Meta(max_length=200)]


class Pause(WireMessage, frozen=True):
    """A request to stop the clock. The reason is written to the log."""

    reason: PauseReason


class Blur(WireMessage, frozen=True):
    """A notice that the page has lost or regained the keyboard focus. It is written to the log."""

    away: bool


class Leave(WireMessage, frozen=True):
    """A request to end the trial immediately."""


class Open(WireMessage, frozen=True):
    """A request to open a session in a worker.

    Attributes:
        restarted: True if the session's previous worker died.
        as_inputs_come: True to run each control step as soon as its inputs have arrived, as in rehearsals.
        texts: HUD texts that override those of the language.
        explains_markers: True if the instructions show a picture of the condition's markers.
    """

    folder: str
    run: str
    config: dict[str, Any]
    before: list[dict[str, Any]] = msgspec.field(default_factory=list)
    restarted: bool = False
    as_inputs_come: bool = False
    floor_plan: bool = True
    language: str = "en"
    texts: dict[str, str] = msgspec.field(default_factory=dict)
    explains_markers: bool = False


class Taken(WireMessage, frozen=True):
    """An acknowledgement that all inputs and control steps up to these numbers are on disk."""

    input: int
    step: int


class FrameMessage(WireMessage, frozen=True, tag="frame"):
    """A rendered frame. Frames are numbered from 1 in each view.

    An H.264 frame is one access unit in Annex B format. A `key` frame can be decoded without earlier frames.
    `input` is the last input in effect, and `milliseconds` is the time taken to draw and compress the frame.
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


class Saved(WireMessage, frozen=True):
    """A notice that the run directory of a finished session is complete."""


class Queue(WireMessage, frozen=True):
    """A notice that all slots are taken. The page must reload to show the queue."""


class Occupied(WireMessage, frozen=True):
    """A notice that the session is open in another page. The reply `takeover` continues it in this page."""


class Replaced(WireMessage, frozen=True):
    """A notice that another page has taken over the session. This connection will be closed."""


class Error(WireMessage, frozen=True):
    """The rejection of a message, with an error code and a reason."""

    code: ErrorCode
    message: str


# Messages that the server forwards
ToSession = RunMessage | Inputs | View | Seen | Beat | Display | Draw | Pause | Blur | Leave
FromSession = State | Taken | SceneMessage | Snapshot | Markers | Pictures | Hud | Moment | Busy | Saved
FromBrowser = Hello | TakeOver | ToSession
ToBrowser = FromSession | Beat | Queue | Occupied | Replaced | Error
ToWorker = Open | ToSession
FromWorker = FromSession | FrameMessage

decode_from_browser: Any = msgspec.json.Decoder(FromBrowser).decode
encode_to_browser = msgspec.json.Encoder().encode
decode_to_worker: Any = msgspec.msgpack.Decoder(ToWorker).decode
decode_from_worker: Any = msgspec.msgpack.Decoder(FromWorker).decode
_encode = msgspec.msgpack.Encoder().encode


def packed(message: WireMessage) -> bytes:
    """Encode a message between server and worker, and prefix it with its length."""
    content = _encode(message)
    return LENGTH.pack(len(content)) + content
