"""An interactive window that shows a running simulation in dm_control's viewer."""

import os
import time
import warnings
from typing import Any

from mjsim.environments.episodes import dm_control_physics
from mjsim.render.diagnostics import INSTALL_DM_CONTROL
from mjsim.values.errors import ViewerError
from mjsim.world.world import World

_BACKEND = "MUJOCO_GL"
_REMEDY = "run it where there is a display, or use render_mode='rgb_array', which needs none"


class InteractiveViewer:
    """A window with dm_control's viewer for Gymnasium's render mode `human`. It has no event loop of its own.

    `width` and `height` are the window size in pixels. If `realtime` is True, `show` waits so that the
    simulation does not run faster than real time.

    Raises:
        ViewerError: There is no display, or GLFW or dm-control is missing.
    """

    def __init__(self, *, width: int = 1024, height: int = 768, realtime: bool = True) -> None:
        self._window: Any = None
        gui, self._render, self._viewer_module, self._renderer_module = _load()
        try:
            self._window = gui.RenderWindow(width, height, "mjsim")
        except Exception as error:  # GLFW and the window system raise exceptions of many types
            raise ViewerError(f"no window could be opened ({error}); {_REMEDY}") from error
        self._viewport = self._renderer_module.Viewport(width, height)
        self._realtime = realtime
        self._world: World | None = None
        self._renderer: Any = None
        self._viewer: Any = None
        self._last_shown = (0.0, 0.0)  # wall-clock time and simulated time of the last frame, in seconds

    def show(self, world: World) -> None:
        """Draw the current state of a world. Raise a ViewerError if the viewer is closed."""
        if self._window is None:
            raise ViewerError("the viewer is closed; open another")
        if world is not self._world:
            self._load_world(world)
        self._wait_for_real_time(world.data.time)
        self._viewport.set_size(*self._window.shape)
        self._window.update(self._pixels)

    def close(self) -> None:
        """Close the window. Repeated calls have no effect."""
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
        physics = dm_control_physics(world)
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

    def _wait_for_real_time(self, simulated: float) -> None:
        clock, before = self._last_shown
        now = time.monotonic()
        if self._realtime and simulated > before:
            time.sleep(max(0.0, min(clock + simulated - before - now, 1.0)))
        self._last_shown = (time.monotonic(), simulated)


def can_open_window() -> bool:
    """Return True if the environment variables allow opening a window."""
    here = any(os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY"))
    return here and os.environ.get(_BACKEND, "glfw") == "glfw"


def _load() -> tuple[Any, Any, Any, Any]:
    """Import dm_control's viewer modules with GLFW as the OpenGL backend.

    A process has a single OpenGL backend, which is fixed on first use. Raise a ViewerError if it is not GLFW.
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
    except ModuleNotFoundError as error:
        raise ViewerError(f"dm-control is not installed ({error}): {INSTALL_DM_CONTROL}") from error
    except Exception as error:  # a missing library raises ImportError, AttributeError or OSError
        raise ViewerError(f"dm_control's viewer cannot be loaded ({error!r}); {_REMEDY}") from error
    return gui, _render, viewer, renderer


def _check_display() -> None:
    """Check that GLFW works before dm_control selects an OpenGL backend for the process."""
    try:
        with warnings.catch_warnings(record=True) as caught:
            import glfw

            is_ready = glfw.init()
    except ImportError as error:
        raise ViewerError(f"GLFW cannot be loaded ({error}); {_REMEDY}") from error
    if not is_ready:
        reasons = "; ".join(str(w.message) for w in caught) or "GLFW gives no reason"
        raise ViewerError(f"no display ({reasons}); {_REMEDY}")
