"""Collects what a page needs to show a run: poses and HUD at every control step."""

import dataclasses
from typing import Any

import msgspec
import numpy as np

from experiments.session.viewer import Viewer
from hud.projection import CameraView
from hud.state import HudState
from mjsim.house.scene import avatar
from mjsim.house.scene.scene import Scene
from mjsim.render.cameras import camera_pose
from mjsim.values.observation import Observation
from mjsim.values.person_parameters import PICTURE_ASPECT
from mjsim.world.world import World

DECIMALS = 4  # of m, rad and quaternions
HEIGHT = 480  # px of the picture in which pointers are found


class RunRecorder(Viewer):
    """A viewer of a session that keeps what it is shown.

    Attributes:
        time: Of each control step, s.
        body: Position, m, heading and pitch, rad, at each, flat: four numbers a step.
        hands: Positions of the left and the right hand in the body's frame, m, flat: six numbers a step.
        objects: For each object its poses where they changed: step, position, m, and quaternion wxyz, flat: eight
            numbers each.
        hud: Step and state without markers, wherever it changed.
        markers: All markers that were shown, each once.
        shown: Step and indices into `markers`, wherever they changed.
    """

    def __init__(self, scene: Scene) -> None:
        self._model = scene.model
        self.time: list[float] = []
        self.body: list[float] = []
        self.hands: list[float] = []
        self.objects: dict[str, list[float]] = {}
        self.hud: list[tuple[int, HudState]] = []
        self.markers: list[Any] = []
        self.shown: list[tuple[int, list[int]]] = []
        self._number: dict[Any, int] = {}
        self._poses: dict[str, list[float]] = {}

    def camera(self, world: World) -> CameraView:
        """The eye camera, in the shape of a film."""
        pose = camera_pose(world.model, world.data, avatar.EYE, PICTURE_ASPECT)
        return CameraView(pose.position, pose.rotation, pose.fovy, round(PICTURE_ASPECT * HEIGHT), HEIGHT)

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None:
        """Keep the present state; a state that is shown twice is kept once."""
        if self.time and self.time[-1] == observation.time:
            return
        step = len(self.time)
        self.time.append(round(float(observation.time), DECIMALS))
        body = [*observation.position, observation.heading, observation.pitch]
        self.body += np.round(body, DECIMALS).tolist()
        self.hands += np.round(world.hands, DECIMALS).ravel().tolist()
        self._keep_objects(step, observation)
        self._keep_hud(step, hud_state)

    def _keep_objects(self, step: int, seen: Observation) -> None:
        poses = np.hstack((seen.object_positions, seen.object_quaternions)).round(DECIMALS).tolist()
        for name, pose in zip(seen.object_names, poses, strict=True):
            if self._poses.get(name) != pose:
                self._poses[name] = pose
                self.objects.setdefault(name, []).extend((step, *pose))

    def _keep_hud(self, step: int, state: HudState) -> None:
        clock = None if state.clock is None else float(int(state.clock))
        pointer = state.pointer and dataclasses.replace(state.pointer, angle=round(state.pointer.angle, 2))
        message = state.message and dataclasses.replace(
            state.message, opacity=round(state.message.opacity, 1)
        )
        plain = dataclasses.replace(
            state, markers=(), minimap=None, clock=clock, pointer=pointer, message=message
        )
        if not self.hud or self.hud[-1][1] != plain:
            self.hud.append((step, plain))
        shown = [self._number_of(marker) for marker in state.markers]
        if not self.shown or self.shown[-1][1] != shown:
            self.shown.append((step, shown))

    def _number_of(self, marker: Any) -> int:
        """Index of a marker, of which the page gets one even if it was shown at every step."""
        place = tuple(round(value, DECIMALS) for value in marker.position)
        kept = dataclasses.replace(marker, position=place)
        if kept not in self._number:
            self._number[kept] = len(self.markers)
            self.markers.append(msgspec.to_builtins(kept))
        return self._number[kept]
