"""First-person frames with the HUD over them, and films of them."""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.video import VideoWriter
from hud.compose import Compositor
from hud.options.minimap import FLOORPLAN
from hud.projection import CameraView
from hud.state import HudState
from mjsim.model.scene import Scene
from mjsim.observation import Observation
from mjsim.render import Renderer, render_house_map, render_pictures
from mjsim.world import World


@dataclass(frozen=True)
class FilmConfig:
    """How frames are made: size in px, and the render profile."""

    width: int = 640
    height: int = 480
    profile: str = "fast"


class FirstPersonRenderer:
    """Makes first-person frames with the HUD over them. Use as a context manager; leaving it frees the GL context.

    Args:
        scene: The scene to render.
        house: The house, for the pictures of its objects and receptacles.
        film: Frame size and render profile.

    Raises:
        RenderError: No off-screen GL context could be made, or the size or profile is unusable.
    """

    def __init__(self, scene: Scene, house: House, film: FilmConfig) -> None:
        self._renderer = Renderer(scene.model, width=film.width, height=film.height, profile=film.profile)
        self._house = house
        self._pictures = render_pictures(house.catalogue)
        self._compositor = Compositor(self._pictures)
        self._size = (film.width, film.height)

    def camera_view(self, data: Any) -> CameraView:
        """The eye camera as the next frame of `data` shows it; a condition needs it to point to a goal."""
        pose = self._renderer.camera_pose(data)
        width, height = self._size
        return CameraView(pose.position, pose.rotation, pose.fovy, width=width, height=height)

    def frame(self, data: Any, state: HudState) -> NDArray[np.uint8]:
        """What the person sees.

        Args:
            data: State of the scene's model.
            state: What the HUD shows; its markers are drawn into the scene.

        Returns:
            RGB, uint8, shape (height, width, 3).

        Raises:
            RenderError: A marker cannot be drawn, or the renderer is closed.
        """
        if state.minimap is not None and FLOORPLAN not in self._pictures:
            self._pictures[FLOORPLAN] = render_house_map(self._house.catalogue, self._house.bounds)
            self._compositor = Compositor(self._pictures)
        return self._compositor.compose(self._renderer.rgb(data, markers=state.markers), state)

    def close(self) -> None:
        """Free the GL context."""
        self._renderer.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Filming:
    """A viewer of a session that writes every frame to a video."""

    def __init__(self, renderer: FirstPersonRenderer, video: VideoWriter) -> None:
        self._renderer = renderer
        self._video = video

    def camera(self, world: World) -> CameraView:
        """The eye camera."""
        return self._renderer.camera_view(world.data)

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None:  # noqa: ARG002 - all is in the world
        """Film one frame."""
        self._video.write(self._renderer.frame(world.data, hud_state))
