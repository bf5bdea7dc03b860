"""Show the film of the house, and record how much of it was played."""

import math
from collections.abc import Mapping
from typing import Any

from experiments.visit.phases.base import Again, Done, FormData, FormPhase, Visitor

PLAYED_S, FILM_S, ERROR = "played_s", "film_s", "film_error"
ENOUGH = 0.95  # fraction of a required film that must be played


class Film(FormPhase):
    """The page with the film of the house. If the browser cannot play it, the participant may continue without it."""

    def values(self, visitor: Visitor) -> Mapping[str, Any]:  # noqa: ARG002 - the same for all participants
        return {"required": self._plan.require_film, "poster": self._plan.poster}

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
        read = super().read(visitor, sent)
        if isinstance(read, Again):
            return read
        found = {name: _number(sent.get(name, "")) for name in (PLAYED_S, FILM_S, ERROR)}
        measured = {name: number for name, number in found.items() if number is not None}
        unplayed = measured.get(PLAYED_S, 0.0) < ENOUGH * measured.get(FILM_S, math.inf)
        if self._plan.require_film and unplayed and ERROR not in measured:
            return Again(self.texts["not_played"])
        return Done({**read.answers, **measured})

    def example(self) -> dict[str, str]:
        played = {PLAYED_S: "1", FILM_S: "1"} if self._plan.require_film else {}
        return {**super().example(), **played}


def _number(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if 0.0 <= number < 1e5 else None
