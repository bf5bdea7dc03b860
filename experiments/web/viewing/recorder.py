"""Record the poses and HUD states for a page that shows a run."""

import dataclasses
from typing import Any

import msgspec
import numpy as np

from experiments.session.session import Viewer
from hud.projection import CameraView
from hud.state import HudState
from mjsim.house.scene import avatar
from mjsim.render.cameras import camera_pose
from mjsim.values.observation import Observation
from mjsim.values.person_parameters import PICTURE_ASPECT
from mjsim.world.world import World

DECIMALS = 4  # number of decimal places of positions, angles and quaternions
HEIGHT = 480  # assumed height of the picture for which pointers are placed, in pixels


class RunRecorder(Viewer):
    """A session viewer that records every state.

    Attributes:
        body: Flat list with four numbers per control step: position in metres, heading and pitch in radians.
        hands: Flat list with six numbers per control step: positions of the left and right hand in metres, in the
            body's frame.
        objects: Flat list for each object with eight numbers per changed pose: control step, position in metres, and
            quaternion wxyz.
        hud: Pairs of a control step and the new state without markers, one for each change of the HUD.
        shown: Pairs of a control step and indices into `markers`, one for each change of the visible markers.
    """

    def __init__(self) -> None:
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
        """Return the eye camera with the aspect ratio of the participant's picture."""
        pose = camera_pose(world.model, world.data, avatar.EYE, PICTURE_ASPECT)
        return CameraView(pose.position, pose.rotation, pose.fovy, round(PICTURE_ASPECT * HEIGHT), HEIGHT)

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None:
        """Record the current state unless it has already been recorded."""
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
        place = tuple(round(value, DECIMALS) for value in marker.position)
        kept = dataclasses.replace(marker, position=place)
        if kept not in self._number:
            self._number[kept] = len(self.markers)
            self.markers.append(msgspec.to_builtins(kept))
        return self._number[kept]
