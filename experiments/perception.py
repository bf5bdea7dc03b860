"""What the participant of a session perceives: its own body, what is in view, and what the HUD shows."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.assistant import GOAL, Assistant
from experiments.participants.base import Choice, Guidance, Percept
from hud.markers import FLAGPOLE, flagpoles
from hud.state import HudState
from mjsim.actions import ActionResult
from mjsim.observation import ObjectStatus, Observation
from mjsim.visibility import visible_objects
from mjsim.world import World

NEARBY = 1.3  # m


@dataclass(frozen=True, eq=False)
class Perception:
    """Makes the percepts of a session.

    Attributes:
        world: The physics.
        assistant: Knows the guidance.
    """

    world: World
    assistant: Assistant

    def percept(
        self, seen: Observation, answer: ActionResult | None, hud: Callable[[], HudState], *, blocked: bool
    ) -> Percept:
        """What the participant perceives now.

        Args:
            seen: State of the world.
            answer: The world's answer to the previous pick or place.
            hud: Gives what the HUD shows.
            blocked: Whether the walk makes no progress.
        """
        return Percept(
            time=seen.time,
            position=seen.position,
            heading=seen.heading,
            hands=seen.hands,
            busy=seen.busy,
            targets=self.world.scene.episode.targets,
            answer=answer,
            blocked=blocked,
            senses=_Senses(self, seen, hud),
        )


class _Senses:
    """`Senses` of a person in a session, at one control step."""

    def __init__(self, perception: Perception, seen: Observation, hud: Callable[[], HudState]) -> None:
        self._perception, self._seen, self._hud = perception, seen, hud

    def nearby(self) -> Mapping[str, NDArray[np.float64]]:
        """Nobody has to look to know what lies at the feet."""
        loose = self._positions(self._seen.names_with(ObjectStatus.LOOSE))
        return {n: p for n, p in loose.items() if math.dist(p, self._seen.position) < NEARBY}

    def look(self) -> Mapping[str, NDArray[np.float64]]:
        """What has been put away stays in view, in its bin, but nobody takes it for misplaced."""
        seen, world = self._seen, self._perception.world
        loose = seen.names_with(ObjectStatus.LOOSE)
        return self._positions(
            visible_objects(world.scene, world.data, seen.eye, seen.heading, seen.pitch, among=loose)
        )

    def hud(self) -> HudState:
        return self._hud()

    def guidance(self) -> Guidance | None:
        assistant = self._perception.assistant
        return assistant.guidance(self._seen) if GOAL in assistant.shown_roles else None

    def flagpoles(self) -> Mapping[str, NDArray[np.float64]]:
        """What the picture shows, and no more."""
        if FLAGPOLE not in self._perception.assistant.shown_roles:
            return {}
        return {name: np.array(place) for name, place in flagpoles(self._hud()).items()}

    def choices(self) -> Sequence[Choice]:
        return self._perception.assistant.choices(self._seen)

    def _positions(self, names: Iterable[str]) -> dict[str, NDArray[np.float64]]:
        """Floor positions by name, m, shape (2,)."""
        seen = self._seen
        return {name: seen.object_positions[seen.object_names.index(name), :2] for name in names}
