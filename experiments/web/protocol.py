"""Messages between browser, server and worker (docs/protocol.md).

A message is an object whose `type` is the tag of its class. Messages between browser and server are JSON, except
binary frames. Messages between server and worker are MessagePack. The server forwards most of them.
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

HOUSE = "MJSIM_PLAY_HOUSE"  # environment variable with the house that the fork server preloads
VERSION = 1  # version of the header of frames
MAX_TEXT = 64 * 1024  # maximum size of a message from the browser, in bytes
MAX_INPUTS = 64  # maximum number of inputs per message
FRAME_HEAD = struct.Struct("<BBBBHHIIQf")
LENGTH = struct.Struct("!I")  # length prefix of messages between server and worker, in bytes
CODECS = {"jpeg": 1, "h264": 2}
BEAT_PERIOD = 0.5  # time between heartbeats, in seconds
MAX_SILENCE = 1.0  # silence after which the connection is considered lost, in seconds
MAX_STEPS_AHEAD = 25  # how far inputs and promises may be ahead of the last step, in control steps
DISPLAY_PERIOD = 5.0  # time between `display` messages, in seconds
KEY_FLAG = 1
REFUSED, REPLACED, IDLE, TOO_MUCH, SLOW = 4000, 4001, 4002, 4003, 4004  # WebSocket close codes

Codec = Literal["jpeg", "h264", "none"]
Drawer = Literal["browser", "server"]  # where the view is drawn
PauseReason = Literal["asked", "hidden", "disconnected", "silent", "restarted", "taken over"]
ErrorCode = Literal["malformed", "too early", "out of order", "too much", "idle"]
Length = Annotated[int, msgspec.Meta(ge=1, le=8192)]  # pixels
Count = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
Angle = Annotated[float, msgspec.Meta(gt=0.0, lt=3.0)]  # horizontal field of view, in radians
Measured = Annotated[float, msgspec.Meta(ge=0.0, le=1e6)]


class View(WireMessage, frozen=True):
    """View requested by a page: size in CSS pixels, and the codec of frames. The codec is `none` if the page draws.

    `field_of_view` is the person's choice, limited to the `field_of_view_range` of the scene.
    """

    width: Length
    height: Length
    codec: Codec = "jpeg"
    field_of_view: Angle | None = None


class Hello(WireMessage, frozen=True):
    """First message of a connection. `tab` is a random name of the page, which it keeps when it reconnects."""

    tab: Annotated[str, msgspec.Meta(pattern="^[A-Za-z0-9-]{8,64}$")]
    trial: Annotated[str, msgspec.Meta(max_length=20)]
    view: View


class TakeOver(WireMessage, frozen=True):
    """Continue a session here that is open in another page. Answers `occupied`."""


class RunMessage(WireMessage, frozen=True, tag="run"):
    """Start or resume the clock. `until` is the page's promise (see `Inputs`), at first 0, or None."""

    until: Count | None = None


class Inputs(WireMessage, frozen=True):
    """Inputs of the person, in order, each once.

    `until` promises that all inputs for the control steps before it have been sent. The clock then waits for promises,
    for at most 0.75 s.
    """

    inputs: Annotated[list[Input], msgspec.Meta(max_length=MAX_INPUTS)]
    until: Count | None = None


class Seen(WireMessage, frozen=True):
    """Number of a frame that the browser has shown."""

    frame: Count


class Beat(WireMessage, frozen=True):
    """Heartbeat. The server sends two per second, and the page answers each.

    The clock stops after 1 s without any message from the page.
    """


class Display(WireMessage, frozen=True):
    """Display quality over the last 5 s. Only logged.

    Attributes:
        width: Width of the view, in CSS pixels. `height` likewise.
        pixel_ratio: Device pixels per CSS pixel.
        frame_ms: Median time between two pictures.
        frame_ms_95: 95th percentile of the time between two pictures.
        latency_ms: Median time from an input to its picture, or to the server's state with that input if the browser
            draws. None without inputs.
        field_of_view: Field of view of the picture if the person may choose it.
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
    """Drawing has moved to the browser or to the server. Only logged, with the reason."""

    draw: Drawer
    reason: Annotated[str, msgspec.Meta(max_length=200)]


class Pause(WireMessage, frozen=True):
    """Stop the clock. The reason is logged."""

    reason: PauseReason


class Blur(WireMessage, frozen=True):
    """The page lost or regained the keyboard focus. Only logged."""

    away: bool


class Leave(WireMessage, frozen=True):
    """End the trial now."""


class Open(WireMessage, frozen=True):
    """Open a session in a worker.

    Attributes:
        restarted: True if the previous worker died.
        as_inputs_come: True to take control steps as soon as their inputs are promised, as in a rehearsal.
        texts: Texts of the HUD that replace those of the language, or empty.
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


class Taken(WireMessage, frozen=True):
    """All inputs and control steps up to these numbers are processed and on disk."""

    input: int
    step: int


class FrameMessage(WireMessage, frozen=True, tag="frame"):
    """A frame of a control step, numbered from 1 in each view. `input` is the last input that has taken effect in it.

    H.264 is in Annex B format, one access unit per frame. `key` frames can be decoded without earlier ones.
    `milliseconds` is the time to draw and compress the frame.
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
    """The run directory of a finished session has been written."""


class Queue(WireMessage, frozen=True):
    """All slots are taken. The page must reload, and then shows the queue."""


class Occupied(WireMessage, frozen=True):
    """The session is open in another page. `takeover` continues it here."""


class Replaced(WireMessage, frozen=True):
    """Another page took the session over. This connection is closed."""


class Error(WireMessage, frozen=True):
    """A message was rejected, with a code and a reason."""

    code: ErrorCode
    message: str


FromBrowser = (
    Hello | TakeOver | RunMessage | Inputs | View | Seen | Beat | Display | Draw | Pause | Blur | Leave
)
ToBrowser = (
    State
    | Taken
    | SceneMessage
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
ToWorker = Open | RunMessage | Inputs | View | Seen | Beat | Display | Draw | Pause | Blur | Leave
FromWorker = (
    State | Taken | FrameMessage | SceneMessage | Snapshot | Markers | Pictures | Hud | Moment | Busy | Saved
)

decode_from_browser: Any = msgspec.json.Decoder(FromBrowser).decode
encode_to_browser = msgspec.json.Encoder().encode
decode_to_worker: Any = msgspec.msgpack.Decoder(ToWorker).decode
decode_from_worker: Any = msgspec.msgpack.Decoder(FromWorker).decode
_encode = msgspec.msgpack.Encoder().encode


def packed(message: WireMessage) -> bytes:
    """Encode a message between server and worker, preceded by its length."""
    content = _encode(message)
    return LENGTH.pack(len(content)) + content
