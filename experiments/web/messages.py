"""What server and worker tell each other. What concerns the browser is passed on as it is (docs/protocol.md).

On the socket between them, a message is its length (4 bytes, little-endian) and then MessagePack.
"""

import struct
from typing import Annotated, Any, Literal

import msgspec

from experiments.web.controls import Input
from hud.state import HudState

Codec = Literal["jpeg", "h264", "none"]
LENGTH = struct.Struct("<I")
MAX_MESSAGE = 16 * 1024 * 1024  # bytes
FORK, END = b"f", b"x"  # what the process that forks workers is told: a worker for this socket; end


class Message(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="type", tag=str.lower):
    """A message; `type` is the name of its class in lower case."""


class Open(Message, frozen=True):
    """Begin a session, or go on with it; a worker that has it open already only says where it stands.

    Attributes:
        folder: Folder of its journal.
        run: Run directory to write when it is over.
        config: Settings of the trial; those of a session that is in the journal already stand there.
        paused: Why the clock is to stand at first, or None.
        before: The phases before this one, as `phase_ended` events say of them.
    """

    folder: str
    run: str
    config: dict[str, Any] | None = None
    paused: str | None = None
    before: list[dict[str, Any]] = []


class Begin(Message, frozen=True):
    """Start the clock, where it does not run yet."""


class Inputs(Message, frozen=True):
    """What the person pressed, in order, each once."""

    inputs: Annotated[list[Input], msgspec.Meta(max_length=64)]


class View(Message, frozen=True):
    """How a browser that has just connected wants to see the session.

    Attributes:
        width: Of its view, px.
        height: Of its view, px.
        codec: How frames are compressed; `none` for no frames.
        state: Whether to send states (poses and HUD) as well.
    """

    width: Annotated[int, msgspec.Meta(ge=1, le=8192)]
    height: Annotated[int, msgspec.Meta(ge=1, le=8192)]
    codec: Codec = "jpeg"
    state: bool = False


class Seen(Message, frozen=True):
    """The browser has shown a frame, by its number."""

    frame: Annotated[int, msgspec.Meta(ge=0, le=2**53)]


class Pause(Message, frozen=True):
    """Stop the clock. The reason goes into the log: `hidden`, `disconnected`, `asked`, `taken over`."""

    reason: Annotated[str, msgspec.Meta(max_length=40)]


class Resume(Message, frozen=True):
    """Let the clock run again."""


class Blur(Message, frozen=True):
    """The page lost the keyboard to another window, or got it back; only the log takes notice."""

    away: bool


class Leave(Message, frozen=True):
    """End the session now."""


class Exit(Message, frozen=True):
    """End the process now; the journal keeps the session."""


ToWorker = Open | Begin | Inputs | View | Seen | Pause | Resume | Blur | Leave | Exit


class Started(Message, frozen=True):
    """First message of a worker, to every server that it meets.

    Attributes:
        process: Its process number.
    """

    process: int


class Ready(Message, frozen=True):
    """The session is open.

    Attributes:
        step: Control steps so far.
        input: Number of the last input that counted.
        resumed: Whether an earlier process had begun it.
        begun: Whether its clock has been started.
    """

    step: int
    input: int
    resumed: bool
    begun: bool


class Taken(Message, frozen=True):
    """Everything up to this input counts, and is safe on the disk."""

    input: int
    step: int


class Frame(Message, frozen=True):
    """A frame.

    Attributes:
        number: 1 for the first frame of a view.
        step: Control step whose start it shows.
        input: Number of the last input that counts in it.
        codec: How `data` is compressed; H.264 in Annex B, one access unit.
        key: Whether it can be decoded without earlier ones.
        width: px.
        height: px.
        milliseconds: What drawing and compressing it took.
        data: The frame.
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


class State(Message, frozen=True):
    """Poses and HUD, for a client that draws by itself.

    Attributes:
        step: Control step whose start it describes.
        input: Number of the last input that counts in it.
        time: Simulated time, s.
        eye: Eye position, m, then heading and pitch, rad.
        objects: Instance name -> position (3), m, and orientation wxyz (4).
        hud: The HUD state.
    """

    step: int
    input: int
    time: float
    eye: list[float]
    objects: dict[str, list[float]]
    hud: HudState


class Text(Message, frozen=True):
    """What the HUD says, for screen readers: the message bar, the list's heading, its rows, the hands."""

    message: str
    title: str
    rows: list[str]
    hands: list[str]


class Busy(Message, frozen=True):
    """Whether a pick or place is under way; what is pressed meanwhile is answered when it comes to its turn."""

    busy: bool


class Paused(Message, frozen=True):
    """The clock stands; `reason` is None when it runs again."""

    reason: str | None


class Over(Message, frozen=True):
    """The session is over.

    Attributes:
        reason: Why, as in the log.
        metrics: What `metrics.json` of the run directory holds; None where nothing was done.
    """

    reason: str
    metrics: dict[str, Any] | None


class Failed(Message, frozen=True):
    """The session cannot go on."""

    message: str


FromWorker = Started | Ready | Taken | Frame | State | Text | Busy | Paused | Over | Failed

encode = msgspec.msgpack.Encoder().encode
decode_to_worker = msgspec.msgpack.Decoder(ToWorker).decode
decode_from_worker = msgspec.msgpack.Decoder(FromWorker).decode


def packed(message: Message) -> bytes:
    """A message as it stands on the socket."""
    content = encode(message)
    return LENGTH.pack(len(content)) + content
