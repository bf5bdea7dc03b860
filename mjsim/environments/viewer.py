"""A window that shows a running world: dm_control's viewer, driven step by step."""

import os
import time
import warnings
from typing import Any, Protocol

from mjsim.environments.dm_physics import physics_of
from mjsim.environments.errors import ViewerError
from mjsim.world import World

_BACKEND = "MUJOCO_GL"
_REMEDY = "run it where there is a display, or use render_mode='rgb_array', which needs none"


class Viewer(Protocol):
    """Shows worlds to a person."""

    def show(self, world: World) -> None:
        """Show the present state of a world."""
        ...

    def close(self) -> None:
        """Close the window; again does nothing."""
        ...


def open_viewer(*, width: int = 1024, height: int = 768, realtime: bool = True) -> Viewer:
    """Open a window.

    Args:
        width: px.
        height: px.
        realtime: Whether `show` waits until as much time has passed as was simulated.

    Raises:
        ViewerError: There is no display, or no GLFW.
    """
    return _DmControlViewer(width, height, realtime)


class _DmControlViewer:
    """dm_control's viewer has a loop of its own; a window for Gymnasium has to be driven from outside."""

    def __init__(self, width: int, height: int, realtime: bool) -> None:
        self._window: Any = None
        gui, self._render, self._viewer_module, self._renderer_module = _load()
        try:
            self._window = gui.RenderWindow(width, height, "mjsim")
        except Exception as error:  # GLFW and the window system raise many unrelated types here
            raise ViewerError(f"no window could be opened ({error}); {_REMEDY}") from error
        self._viewport = self._renderer_module.Viewport(width, height)
        self._realtime = realtime
        self._world: World | None = None
        self._renderer: Any = None
        self._viewer: Any = None
        self._shown_at = (0.0, 0.0)

    def show(self, world: World) -> None:
        """Show a world, and keep up with real time."""
        if self._window is None:
            raise ViewerError("the viewer is closed; open another")
        if world is not self._world:
            self._load_world(world)
        self._keep_pace(world.data.time)
        self._viewport.set_size(*self._window.shape)
        self._window.update(self._pixels)

    def close(self) -> None:
        """Close the window."""
        self._release()
        if self._window is not None:
            self._window.close()
            self._window = None

    def _pixels(self) -> Any:
        self._viewer.render()
        return self._renderer.pixels

    def _load_world(self, world: World) -> None:
        self._release()
        self._world = world
        physics = physics_of(world)
        surface = self._render.Renderer(max_width=2048, max_height=2048)
        self._renderer = self._renderer_module.OffScreenRenderer(physics.model, surface)
        self._viewer = self._viewer_module.Viewer(self._viewport, self._window.mouse, self._window.keyboard)
        self._viewer.initialize(physics, self._renderer, touchpad=False)
        self._viewer.zoom_to_scene()

    def _release(self) -> None:
        if self._viewer is not None:
            self._viewer.deinitialize()
            self._renderer.release()
            self._viewer = self._renderer = self._world = None

    def _keep_pace(self, simulated: float) -> None:
        clock, before = self._shown_at
        now = time.monotonic()
        if self._realtime and simulated > before:
            time.sleep(max(0.0, min(clock + simulated - before - now, 1.0)))
        self._shown_at = (time.monotonic(), simulated)


def _load() -> tuple[Any, Any, Any, Any]:
    """dm_control's modules of the viewer, with GLFW as the OpenGL backend of this process.

    A process has one backend, for windows and off screen alike; a window made first settles it.

    Raises:
        ViewerError: Another backend is in use, or GLFW cannot be loaded.
    """
    if os.environ.get(_BACKEND, "glfw") != "glfw":
        raise ViewerError(
            f"a window needs the OpenGL backend glfw, and this process uses {_BACKEND}={os.environ[_BACKEND]}; "
            f"start the program with {_BACKEND}=glfw, or {_REMEDY}"
        )
    _check_display()
    os.environ[_BACKEND] = "glfw"
    try:
        from dm_control import _render
        from dm_control.viewer import gui, renderer, viewer
    except Exception as error:  # a missing library surfaces as ImportError, AttributeError or OSError
        raise ViewerError(f"dm_control's viewer cannot be loaded ({error!r}); {_REMEDY}") from error
    return gui, _render, viewer, renderer


def _check_display() -> None:
    """Ask GLFW alone first: dm_control would settle the process's backend before it fails."""
    try:
        with warnings.catch_warnings(record=True) as reasons:
            import glfw

            ready = glfw.init()
    except ImportError as error:
        raise ViewerError(f"GLFW cannot be loaded ({error}); {_REMEDY}") from error
    if not ready:
        said = "; ".join(str(r.message) for r in reasons) or "GLFW gives no reason"
        raise ViewerError(f"no display ({said}); {_REMEDY}")
