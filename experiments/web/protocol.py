"""What browser and server tell each other on the WebSocket (docs/protocol.md).

Text messages are JSON; `type` is the name of the class in lower case. A binary message is a frame: `FRAME_HEAD`, then
the picture.
"""

import struct
from typing import Annotated, Any, Literal

import msgspec

from experiments.web.messages import (
    Begin,
    Blur,
    Busy,
    Failed,
    Frame,
    Inputs,
    Leave,
    Message,
    Over,
    Pause,
    Paused,
    Ready,
    Resume,
    Seen,
    State,
    Taken,
    Text,
    View,
)

VERSION = 1
MAX_TEXT = 64 * 1024  # bytes of a message from the browser
FRAME_HEAD = struct.Struct("<BBBBHHIIQf")
CODECS = {"jpeg": 1, "h264": 2}
KEY_FLAG = 1
REFUSED, REPLACED, IDLE, TOO_MUCH, SLOW = 4000, 4001, 4002, 4003, 4004  # codes with which the server closes

ErrorCode = Literal["malformed", "too early", "out of order", "too much", "idle"]


class Hello(Message, frozen=True):
    """First message of a connection.

    Attributes:
        tab: Random name of this page. A page that connects again takes the place of its own old connection.
        phase: Part of the visit that the page shows: `training` or `task`.
        view: How it wants to see the session.
    """

    tab: Annotated[str, msgspec.Meta(pattern="^[A-Za-z0-9-]{8,64}$")]
    phase: Annotated[str, msgspec.Meta(max_length=20)]
    view: View


class TakeOver(Message, frozen=True):
    """Go on here with a session that is open elsewhere; the answer to `occupied`."""


FromBrowser = Hello | TakeOver | Begin | Inputs | View | Seen | Pause | Resume | Blur | Leave


class Queue(Message, frozen=True):
    """All places are taken; the session begins by itself when it is its turn.

    Attributes:
        position: 1 for the next one.
    """

    position: int


class Occupied(Message, frozen=True):
    """The session is open elsewhere; `takeover` goes on here."""


class Replaced(Message, frozen=True):
    """The session goes on elsewhere; this connection is closed."""


class Recovering(Message, frozen=True):
    """The session was interrupted and is being restored; `ready` follows."""


class Error(Message, frozen=True):
    """A message was refused; nothing of it counts.

    Attributes:
        code: What was wrong with it.
        message: In words.
    """

    code: ErrorCode
    message: str


ToBrowser = (
    Ready
    | Taken
    | State
    | Text
    | Busy
    | Paused
    | Over
    | Failed
    | Queue
    | Occupied
    | Replaced
    | Recovering
    | Error
)

decode_from_browser: Any = msgspec.json.Decoder(FromBrowser).decode
decode_to_browser: Any = msgspec.json.Decoder(ToBrowser).decode
encode_to_browser = msgspec.json.Encoder().encode


def packed_frame(frame: Frame) -> bytes:
    """A frame as a binary message."""
    return FRAME_HEAD.pack(
        VERSION,
        CODECS[frame.codec],
        KEY_FLAG if frame.key else 0,
        0,
        frame.width,
        frame.height,
        frame.number,
        frame.step,
        frame.input,
        frame.milliseconds,
    ) + bytes(frame.data)
