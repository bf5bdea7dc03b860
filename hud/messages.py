"""The messages that the message bar shows (PAPER section 3.2)."""

from types import MappingProxyType
from typing import Final

from hud.errors import MessageError
from hud.lists import in_sentence
from hud.state import Message, MessageKind
from hud.texts import HudTexts, filled

SHOWN = 3.5  # time for which a message has full opacity, in seconds
FADE = 0.5  # time for which a message fades out, in seconds

_OK, _NO, _INFO = MessageKind.SUCCESS, MessageKind.REFUSAL, MessageKind.INFO

KINDS: Final = MappingProxyType(
    {
        "picked": _OK,
        "placed": _OK,
        "finished": _OK,
        "replanned": _INFO,
        "started": _INFO,
        "pick_failed": _NO,
        "place_failed": _NO,
        "grip_lost": _NO,
        "ejected": _NO,
        "tunnelled": _NO,
        "dislodged": _NO,
        "busy": _NO,
        "nothing_in_reach": _NO,
        "out_of_reach": _NO,
        "hands_full": _NO,
        "hands_empty": _NO,
        "not_carried": _NO,
        "already_carried": _NO,
        "already_delivered": _NO,
        "not_the_receptacle": _NO,
        "receptacle_out_of_reach": _NO,
        "unknown_object": _NO,
    }
)


def message(
    key: str,
    texts: HudTexts,
    *,
    object: str | None = None,
    receptacle: str | None = None,
    opacity: float = 1.0,
) -> Message:
    """Return the message for an event ("picked") or a refusal ("hands_full").

    `object` and `receptacle` are labels. Raises MessageError if the key is unknown.
    """
    if key not in KINDS:
        raise MessageError(f"no message {key!r}; there are {', '.join(KINDS)}")
    text = filled(
        getattr(texts, key),
        object=texts.object if object is None else in_sentence(object),
        receptacle=texts.receptacle if receptacle is None else in_sentence(receptacle),
        Object=object or texts.object,
        Receptacle=receptacle or texts.receptacle,
    )
    return Message(text, KINDS[key], opacity)


def fade(age: float) -> float:
    """Return the opacity of a message that appeared `age` seconds ago."""
    return min(1.0, max(0.0, (SHOWN + FADE - age) / FADE))
