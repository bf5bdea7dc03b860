"""Render and film the first-person view with the HUD."""

import dataclasses
import math
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.errors import RecordError
from experiments.house import House
from experiments.session.film_config import FilmConfig
from experiments.session.video import VideoWriter
from hud.compose import Compositor
from hud.projection import CameraView
from hud.state import FLOORPLAN, HudState
from mjsim.house.scene.avatar import EYE
from mjsim.house.scene.scene import Scene
from mjsim.render import Renderer, gl_info, render_house_map, render_pictures
from mjsim.render.cameras import CameraPose
from mjsim.values.errors import RenderError
from mjsim.values.observation import Observation
from mjsim.world.world import World


class FirstPersonRenderer(AbstractContextManager["FirstPersonRenderer"]):
    """A renderer of first-person frames with the HUD. Use it as a context manager to free the GL context.

    Raises RenderError if there is no off-screen GL context, or if the size or the profile is invalid.
    """

    def __init__(self, scene: Scene, house: House, film: FilmConfig) -> None:
        _, _, width, height = film.view
        self._renderer = Renderer(scene.model, width=width, height=height, profile=film.profile)
        self._house = house
        self._pictures = render_pictures(house.catalogue)
        self._film = film
        self._compositor = self._new_compositor()

    def camera_view(self, data: Any) -> CameraView:
        """Return the view of the eye camera. `data` is the state of the scene's model."""
        pose = self._renderer.camera_pose(data, self._camera(data))
        _, _, width, height = self._film.view
        return CameraView(pose.position, pose.rotation, pose.fovy, width=width, height=height)

    def frame(self, data: Any, state: HudState) -> NDArray[np.uint8]:
        """Render the person's view with the HUD as an RGB image, uint8, shape (height, width, 3).

        `data` is the state of the scene's model. Raises RenderError if a marker cannot be drawn or the renderer is
        closed.
        """
        if state.minimap is not None and FLOORPLAN not in self._pictures:
            self._pictures[FLOORPLAN] = render_house_map(self._house.catalogue, self._house.bounds)
            self._compositor = self._new_compositor()
        left, top, width, height = self._film.view
        frame = np.zeros((self._film.height, self._film.width, 3), np.uint8)
        picture = self._renderer.rgb(data, self._camera(data), state.markers)
        frame[top : top + height, left : left + width] = picture
        return self._compositor.compose(frame, state)

    def _new_compositor(self) -> Compositor:
        return Compositor(self._pictures, self._house.texts, beside=self._film.picture is not None)

    def _camera(self, data: Any) -> str | CameraPose:
        film = self._film
        if film.field_of_view is None:
            return EYE
        _, _, width, height = film.view
        fovy = 2.0 * math.atan(math.tan(film.field_of_view / 2.0) * height / width)
        return dataclasses.replace(self._renderer.camera_pose(data), fovy=fovy)

    def close(self) -> None:
        self._renderer.close()

    def __exit__(self, *_: object) -> None:
        self.close()


class Filming:
    """A viewer that writes every frame of a session to a video."""

    def __init__(self, renderer: FirstPersonRenderer, video: VideoWriter) -> None:
        self._renderer = renderer
        self._video = video

    def camera(self, world: World) -> CameraView:
        return self._renderer.camera_view(world.data)

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None:  # noqa: ARG002 - required by the protocol
        self._video.write(self._renderer.frame(world.data, hud_state))


class TrialFilm:
    """A viewer that films a trial. If filming fails, the trial continues without a film.

    Attributes:
        failure: Reason why there is no film, or None.
        renderer_name: Name of the GL renderer, or None.
    """

    def __init__(self, scene: Scene, house: House, film: FilmConfig, path: Path) -> None:
        self._path = path
        self.failure: str | None = None
        self.renderer_name: str | None = None
        self._renderer: FirstPersonRenderer | None = None
        self._video: VideoWriter | None = None
        try:
            self._renderer = FirstPersonRenderer(scene, house, film)
            self.renderer_name = gl_info().renderer
            self._video = VideoWriter(path, width=film.width, height=film.height)
        except (RenderError, RecordError, OSError) as error:
            self._give_up(error)

    @property
    def frames_sha256(self) -> str | None:
        """Hash of all frames, available after `close`, or None if there is no film."""
        return self._video.frames_sha256 if self._video is not None and self.failure is None else None

    def camera(self, world: World) -> CameraView | None:
        return self._renderer.camera_view(world.data) if self._renderer is not None else None

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None:  # noqa: ARG002 - required by the protocol
        if self.failure is None and self._renderer is not None and self._video is not None:
            try:
                self._video.write(self._renderer.frame(world.data, hud_state))
            except (RenderError, RecordError) as error:
                self._give_up(error)

    def close(self) -> None:
        """Complete the video file, or delete it if filming has failed."""
        try:
            if self._video is not None:
                self._video.close()
        except RecordError as error:
            self._give_up(error)
        if self._renderer is not None:
            # after a driver failure, freeing the GL context may fail as well
            with suppress(RenderError):
                self._renderer.close()
        if self.failure is not None:
            self._path.unlink(missing_ok=True)

    def _give_up(self, error: Exception) -> None:
        self.failure = self.failure or f"no video: {error}"
