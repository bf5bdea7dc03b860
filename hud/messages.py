"""Texts of the message bar, and how it fades (PAPER section 3.2)."""

from types import MappingProxyType
from typing import Final

from hud.errors import MessageError
from hud.lists import in_sentence
from hud.state import Message, MessageKind

SHOWN = 3.5  # s at full opacity
FADE = 0.5  # s from opaque to gone

_OK, _NO, _INFO = MessageKind.SUCCESS, MessageKind.REFUSAL, MessageKind.INFO

# {object} and {receptacle} are labels as they read inside a sentence; no verb agrees with them ("denim shorts").
TEXTS: Final = MappingProxyType(
    {
        "picked": (_OK, "You picked up the {object}."),
        "placed": (_OK, "You put the {object} in the {receptacle}."),
        "finished": (_OK, "All done. Everything is where it belongs."),
        "replanned": (_INFO, "The plan has been updated."),
        "started": (_INFO, "Put every object into its bin."),
        "pick_failed": (_NO, "The {object} slipped. Try again from a little closer."),
        "place_failed": (_NO, "The {object} did not stay in the {receptacle}. Try again."),
        "grip_lost": (_NO, "You dropped the {object} on the way."),
        "ejected": (_NO, "The {object} flew off."),
        "tunnelled": (_NO, "The {object} slipped through a gap."),
        "dislodged": (_NO, "The {object} fell out of the {receptacle}."),
        "busy": (_NO, "One moment: your hands are still moving."),
        "nothing_in_reach": (_NO, "Nothing in reach. Walk closer to an object or a bin."),
        "out_of_reach": (_NO, "Walk closer to reach the {object}."),
        "hands_full": (_NO, "You cannot carry more. Put something away first."),
        "hands_empty": (_NO, "Your hands are empty. Pick something up first."),
        "not_carried": (_NO, "You are not holding the {object}."),
        "already_carried": (_NO, "You are already holding the {object}."),
        "already_delivered": (_NO, "You have already put the {object} away."),
        "not_the_receptacle": (_NO, "Not here: take the {object} to the {receptacle}."),
        "receptacle_out_of_reach": (_NO, "Walk closer to reach the {receptacle}."),
        "unknown_object": (_NO, "There is no such object here."),
    }
)

GENERIC: Final = MappingProxyType({"object": "object", "receptacle": "right bin"})


def message(
    key: str, *, object: str | None = None, receptacle: str | None = None, opacity: float = 1.0
) -> Message:
    """The message for an event or a refusal ("picked", "hands_full"), with labels of the object and the receptacle."""
    if key not in TEXTS:
        raise MessageError(f"no message {key!r}; there are {', '.join(TEXTS)}")
    kind, template = TEXTS[key]
    text = template.format(
        object=GENERIC["object"] if object is None else in_sentence(object),
        receptacle=GENERIC["receptacle"] if receptacle is None else in_sentence(receptacle),
    )
    return Message(text, kind, opacity)


def fade(age: float) -> float:
    """Opacity of a message of `age` seconds: full for `SHOWN`, then linearly down to 0 within `FADE`."""
    return min(1.0, max(0.0, (SHOWN + FADE - age) / FADE))
