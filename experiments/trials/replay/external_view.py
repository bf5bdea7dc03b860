"""Film a run from above or from a camera that circles the house."""

import math
from collections.abc import Callable

import numpy as np

from experiments.session.film_config import TOP_DOWN, FilmConfig
from experiments.session.video import VideoWriter
from hud.projection import CameraView
from hud.state import HudState, Marker, Rgba, Vec3
from mjsim.house.scene.scene import Scene
from mjsim.render import CameraPose, LayeredRenderer
from mjsim.render.rasteriser import TOP_DOWN_GROUPS
from mjsim.values.observation import Observation
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.world import World

# A function that maps the simulated time in seconds to a camera pose
CameraPath = Callable[[float], CameraPose]
Bounds = tuple[float, float, float, float]

_TOP_DOWN_FOV = math.radians(20.0)
_FREE_FOV = math.radians(50.0)
# Factor that increases the distance of the camera so that the tops of the walls are in the picture
_MARGIN = 1.12
_ORBIT_PERIOD_S = 90.0
_ELEVATION = math.radians(52.0)
_BODY_COLOUR: Rgba = (0.85, 0.10, 0.55, 1.0)  # a colour that no object has
_HEAD_COLOUR: Rgba = (0.93, 0.74, 0.22, 1.0)


def camera_path(
    camera: str, bounds: Bounds, aspect: float, eye: Vec3 | None = None, target: Vec3 | None = None
) -> CameraPath:
    """Return a function that maps the simulated time to the pose of an external camera.

    Args:
        camera: `top-down` or `free`.
        bounds: Bounds of the floor in metres: x_min, y_min, x_max, y_max.
        aspect: Width of the frames divided by their height.
        eye: Position of a free camera in metres, or None to circle the house.
        target: Point at which a free camera looks, in metres, or None for the middle of the floor.
    """
    x_min, y_min, x_max, y_max = bounds
    middle = np.array([(x_min + x_max) / 2, (y_min + y_max) / 2, 0.0])
    width, depth = x_max - x_min, y_max - y_min
    if camera == TOP_DOWN:
        height = 0.5 * _MARGIN * max(depth, width / aspect) / math.tan(_TOP_DOWN_FOV / 2)
        pose = CameraPose.looking_at(middle + np.array([0.0, 0.0, height]), middle, _TOP_DOWN_FOV)
        return lambda _: pose
    aim = middle if target is None else np.array(target)
    if eye is not None:
        fixed = CameraPose.looking_at(eye, aim, _FREE_FOV)
        return lambda _: fixed
    # At this distance, the view contains a sphere around the whole floor.
    half_angle = math.atan(math.tan(_FREE_FOV / 2) * min(1.0, aspect))
    distance = 0.5 * math.hypot(width, depth) / math.sin(half_angle)

    def circle(time: float) -> CameraPose:
        angle = 2.0 * math.pi * time / _ORBIT_PERIOD_S - math.pi / 2
        out = math.cos(_ELEVATION)
        offset = np.array([out * math.cos(angle), out * math.sin(angle), math.sin(_ELEVATION)])
        return CameraPose.looking_at(aim + distance * offset, aim, _FREE_FOV)

    return circle


class ExternalViewer:
    """A viewer that films a session from outside the house. It must be closed after use.

    Args:
        scene: The scene to render.
        film: Frame size and render profile.
        camera: Function that returns the camera pose at a simulated time.
        video: Writer that receives the frames.

    Raises:
        RenderError: No off-screen GL context could be created, or the frame size or the profile is invalid.
    """

    def __init__(self, scene: Scene, film: FilmConfig, camera: CameraPath, video: VideoWriter) -> None:
        self._renderer = LayeredRenderer(
            scene.model, width=film.width, height=film.height, profile=film.profile, groups=TOP_DOWN_GROUPS
        )
        self._camera, self._person = camera, scene.person
        self._video = video

    def camera(self, world: World) -> CameraView | None:  # noqa: ARG002 - part of the protocol
        """Return None, because the HUD is not shown in an external view."""
        return None

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None:
        """Film one frame of the house with the person and the markers of the HUD."""
        markers = [*hud_state.markers, *figure(observation, self._person)]
        self._video.write(self._renderer.rgb(world.data, self._camera(observation.time), markers=markers))

    def close(self) -> None:
        self._renderer.close()


def figure(observation: Observation, person: PersonParameters) -> tuple[Marker, ...]:
    """Return markers that represent the person: a body, a head, and a nose that points along the heading."""
    x, y = (float(v) for v in observation.position)
    c, s = math.cos(observation.heading), math.sin(observation.heading)
    height, radius = person.eye_height, person.body_radius
    body = height - 0.25
    return (
        Marker("cylinder", (x, y, body / 2), (radius, body / 2, 0.0), _BODY_COLOUR, "person", x_ray=True),
        Marker("sphere", (x, y, height), (0.14, 0.0, 0.0), _HEAD_COLOUR, "person"),
        Marker("sphere", (x + 0.15 * c, y + 0.15 * s, height), (0.06, 0.0, 0.0), _BODY_COLOUR, "person"),
    )
