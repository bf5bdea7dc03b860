"""The texts of the HUD in one language."""

import re
from dataclasses import dataclass

_PLACE = re.compile(r"\{(\w+)\}")


@dataclass(frozen=True)
class HudTexts:
    """All texts that the HUD shows.

    `{object}` and `{receptacle}` are replaced with a label within a sentence ("blue mug"), `{Object}` and
    `{Receptacle}` with the label itself ("Blue mug").
    """

    # Texts for the task list, the bins and the hands
    to_put_away: str
    your_plan: str
    pick_up: str
    put_in: str  # contains the placeholder {Receptacle}
    at_least: str  # contains the placeholder {metres}
    decimal: str  # the decimal separator
    left: str  # contains the placeholder {count}
    none_left: str
    none_left_carried: str  # contains the placeholder {count}
    next_step: str  # contains the placeholders {number} and {count}
    done: str
    above: str  # contains the placeholder {count}
    more: str  # contains the placeholder {count}
    bins: str
    more_bins: str  # contains the placeholder {count}
    left_hand: str
    right_hand: str
    empty: str
    # Texts on the floor plan that shows the paths of a trial
    path_planned: str  # contains the placeholder {metres}
    path_walked: str  # contains the placeholder {metres}
    path_start: str
    recorded: str
    # Words that messages use if an object or receptacle has no label
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
