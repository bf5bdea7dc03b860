"""Words of the HUD in one language."""

import re
from dataclasses import dataclass

_PLACE = re.compile(r"\{(\w+)\}")


@dataclass(frozen=True)
class HudTexts:
    """All words that the HUD draws.

    `{object}` and `{receptacle}` stand for a label within a sentence ("blue mug"), `{Object}` and `{Receptacle}` for
    the label itself ("Blue mug").
    """

    # Task list, bins and hands
    to_put_away: str
    your_plan: str
    pick_up: str
    put_in: str  # contains {Receptacle}
    at_least: str  # contains {metres}
    decimal: str  # the decimal separator
    left: str  # contains {count}
    none_left: str
    next_step: str  # contains {number} and {count}
    done: str
    above: str  # contains {count}
    more: str  # contains {count}
    bins: str
    more_bins: str  # contains {count}
    left_hand: str
    right_hand: str
    empty: str
    # Floor plan with the paths of a trial
    path_planned: str  # contains {metres}
    path_walked: str  # contains {metres}
    path_start: str
    recorded: str
    # Stand-ins for labels in messages
    object: str
    receptacle: str
    # Messages about events and refusals
    picked: str
    placed: str
    finished: str
    replanned: str
    started: str
    pick_failed: str
    place_failed: str
    grip_lost: str
    ejected: str
    tunnelled: str
    dislodged: str
    busy: str
    nothing_in_reach: str
    out_of_reach: str
    hands_full: str
    hands_empty: str
    not_carried: str
    already_carried: str
    already_delivered: str
    not_the_receptacle: str
    receptacle_out_of_reach: str
    unknown_object: str


def filled(text: str, **values: object) -> str:
    """Replace each `{name}` in a text with its value. Names without a value are left as they are."""
    return _PLACE.sub(lambda place: str(values.get(place[1], place[0])), text)
