"""The percepts of participants in a session."""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

import numpy as np

from experiments.participants.base import Choice, Guidance, Percept, Point, positions_of
from experiments.session.assistant import Assistant
from hud.markers import FLAGPOLE, flagpoles
from hud.state import HudState
from mjsim.house.compiled.sites import ReceptacleGeometry
from mjsim.house.sight.drawn_state import drawn_state
from mjsim.house.sight.sight import (
    FieldOfView,
    in_field_of_view,
    persons_geoms,
    visible_objects,
    visible_receptacles,
    visible_shares,
)
from mjsim.values.actions import ActionResult
from mjsim.values.observation import ObjectStatus, Observation
from mjsim.world.world import World


class SessionPercept(Percept):
    """A percept in a session. Expensive parts are computed only when they are accessed."""

    def __init__(
        self,
        seen: Observation,
        answer: ActionResult | None,
        world: World,
        assistant: Assistant,
        hud: Callable[[], HudState],
        *,
        blocked: bool,
    ) -> None:
        scene, capacity = world.scene, world.options.capacity
        super().__init__(
            seen, scene.episode.targets, answer, blocked=blocked, capacity=capacity, person=scene.person
        )
        self._world, self._assistant, self._hud = world, assistant, hud

    def look(self) -> Mapping[str, Point]:
        return self._in_view

    @cached_property
    def visible_shares(self) -> Mapping[str, float]:
        seen, world = self._seen, self._world
        return visible_shares(
            world.scene, world.data, seen.eye, seen.heading, seen.pitch, among=list(self._in_view)
        )

    @cached_property
    def _in_view(self) -> Mapping[str, Point]:
        seen, world = self._seen, self._world
        loose = seen.names_with(ObjectStatus.LOOSE)
        names = visible_objects(world.scene, world.data, seen.eye, seen.heading, seen.pitch, among=loose)
        return positions_of(seen, names)

    def look_for(self, receptacles: Mapping[str, ReceptacleGeometry]) -> frozenset[str]:
        seen = self._seen
        scene, data = drawn_state(self._world.scene, self._world.data)
        return visible_receptacles(
            scene.model,
            data,
            receptacles,
            seen.eye,
            seen.heading,
            seen.pitch,
            field=FieldOfView.of(self.person),
            own=persons_geoms(scene),
        )

    def hud(self) -> HudState:
        return self._hud()

    @property
    def shown_roles(self) -> frozenset[str]:
        return self._assistant.shown_roles

    @cached_property
    def guidance(self) -> Guidance | None:
        return self._assistant.guidance(self._seen)

    @cached_property
    def flagpoles(self) -> Mapping[str, Point]:
        if FLAGPOLE not in self._assistant.shown_roles:
            return {}
        seen, state = self._seen, self._hud()
        parts = [marker for marker in state.markers if marker.role == FLAGPOLE]
        field = FieldOfView.of(self.person)
        shown = in_field_of_view([part.position for part in parts], seen.eye, seen.heading, seen.pitch, field)
        names = {part.object for part, is_shown in zip(parts, shown, strict=True) if is_shown}
        return {name: np.array(place) for name, place in flagpoles(state).items() if name in names}

    @cached_property
    def choices(self) -> Sequence[Choice]:
        return self._assistant.choices(self._seen)
