"""The OpenGL context of the process, which is created when it is first used.

Each use acquires a lock, makes the context current in the calling thread, and restores the previous context
afterwards. Any thread can therefore draw, and the contexts of other libraries are not affected. Switching
contexts takes about 0.03 ms.
"""

import atexit
import contextlib
import importlib
import os
import queue
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import mujoco

from mjsim.support.environment import BACKENDS, DEFAULT, DISABLED, EGL_PACKAGES, VARIABLE, chosen_gl
from mjsim.values.errors import RenderError

EGL_REMEDY = (
    f"install an EGL driver, on Debian or Ubuntu: apt-get install {' '.join(EGL_PACKAGES)}; "
    "`mjsim doctor` shows what is there"
)
TIMEOUT_VARIABLE = "MJSIM_GL_TIMEOUT"
MAX_START_TIME = 60.0  # default timeout for starting an OpenGL driver, in seconds
_MAIN_THREAD_ONLY = ("glfw", "cgl")
_SOFTWARE_RENDERERS = ("llvmpipe", "softpipe", "swrast", "software", "swiftshader")


@dataclass(frozen=True)
class GlInfo:
    """Information about the OpenGL driver that this process uses."""

    vendor: str  # value of GL_VENDOR
    renderer: str  # value of GL_RENDERER, which names the GPU or the software rasterizer
    version: str  # value of GL_VERSION
    software: bool  # True if the CPU renders


def is_software(renderer: str) -> bool:
    """Return True if a GL_RENDERER string names a rasterizer that runs on the CPU."""
    return any(name in renderer.lower() for name in _SOFTWARE_RENDERERS)


class _ProcessContext:
    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._gl: Any = None
        self._egl: ModuleType | None = None
        self._failure: RenderError | None = None
        self._pid = 0
        self._depth = 0
        self._owned: dict[int, Any] = {}

    @contextlib.contextmanager
    def current(self) -> Iterator[None]:
        with self._lock:
            self._ensure()
            if self._depth:  # nested use: this thread has already made the context current
                yield
                return
            with _as_render_errors():
                previous = self._current_binding()
                self._gl.make_current()
                try:
                    self._depth = 1
                    yield
                finally:
                    self._depth = 0
                    self._restore(previous)

    def own(self, mujoco_context: Any) -> int:
        with self._lock:
            self._owned[id(mujoco_context)] = mujoco_context
            return id(mujoco_context)

    def release(self, key: int) -> None:
        with self._lock:
            mujoco_context = self._owned.pop(key, None)
            # A forked child process must not use the driver threads of its parent.
            if mujoco_context is None or self._gl is None or self._pid != os.getpid():
                return
            with self.current():
                mujoco_context.free()

    def close(self) -> None:
        with self._lock:
            if self._gl is None or self._pid != os.getpid():
                return
            # If dm_control was imported later, its exit hook has already terminated the shared display.
            if self._display_lives():
                for key in list(self._owned):
                    self.release(key)
                self._gl.free()
            else:
                self._gl._context = None  # was freed with the display; the finalizer must not free it again
            self._gl = None

    def _display_lives(self) -> bool:
        try:
            with self.current():
                return True
        except Exception:  # PyOpenGL raises exceptions of many types
            return False

    def _ensure(self) -> None:
        if self._failure is not None:  # do not try again, because a second attempt could hang too
            raise self._failure
        if self._gl is None:
            try:
                module, self._gl = _start()
            except RenderError as error:
                self._failure = error
                raise
            self._egl = getattr(module, "EGL", None)
            self._pid = os.getpid()
            atexit.register(self.close)
        elif self._pid != os.getpid():
            raise RenderError(
                f"the OpenGL context was made in process {self._pid} before a fork and is unusable in "
                f"{os.getpid()}; start workers with the 'spawn' method, or draw only after the fork"
            )

    def _current_binding(self) -> tuple[Any, ...] | None:
        if self._egl is None:
            return None
        egl = self._egl
        context = egl.eglGetCurrentContext()
        # Our own context may still be current if a signal interrupted drawing before it was released.
        if not context or context.address == self._gl._context.address:
            return None
        surfaces = egl.eglGetCurrentSurface(egl.EGL_DRAW), egl.eglGetCurrentSurface(egl.EGL_READ)
        return egl.eglGetCurrentDisplay(), *surfaces, context

    def _restore(self, previous: tuple[Any, ...] | None) -> None:
        if self._egl is None or self._gl is None:
            return
        egl = self._egl
        if previous is None:
            display = egl.eglGetCurrentDisplay()
            previous = (display, egl.EGL_NO_SURFACE, egl.EGL_NO_SURFACE, egl.EGL_NO_CONTEXT)
        egl.eglMakeCurrent(*previous)


@contextlib.contextmanager
def _as_render_errors() -> Iterator[None]:
    try:
        yield
    except (mujoco.FatalError, *_opengl_errors()) as error:
        raise RenderError(
            f"OpenGL failed while drawing ({' '.join(str(error).split())}); {EGL_REMEDY}"
        ) from error


def _opengl_errors() -> tuple[type[Exception], ...]:
    # PyOpenGL may not have been imported yet, because it is loaded when the first image is drawn.
    module = sys.modules.get("OpenGL.error")
    return () if module is None else (module.Error,)


def _start() -> tuple[ModuleType, Any]:
    """Load the backend and create a context, or raise a RenderError after a timeout.

    A driver that hangs cannot be interrupted, so it is started in a thread that can be abandoned.
    """
    limit = _time_limit()
    answers: queue.SimpleQueue[tuple[ModuleType, Any] | RenderError] = queue.SimpleQueue()

    def start() -> None:
        try:
            module = _backend()
            answers.put((module, module.GLContext(1, 1)))
        except RenderError as error:
            answers.put(error)
        except Exception as error:  # drivers and PyOpenGL raise exceptions of many types
            answers.put(RenderError(f"no OpenGL context ({error}); {EGL_REMEDY}"))

    if chosen_gl() in _MAIN_THREAD_ONLY:
        start()
    else:
        threading.Thread(target=start, name="gl-start", daemon=True).start()
    try:
        answer = answers.get(timeout=limit)
    except queue.Empty:
        raise RenderError(
            f"the OpenGL driver did not start within {limit:g} s: the GPU may be lost or held by another process "
            f"(nvidia-smi tells); choose another with MUJOCO_EGL_DEVICE_ID, or wait longer with {TIMEOUT_VARIABLE}=120"
        ) from None
    if isinstance(answer, RenderError):
        raise answer
    return answer


def _time_limit() -> float:
    text = os.environ.get(TIMEOUT_VARIABLE, "")
    try:
        limit = float(text) if text else MAX_START_TIME
    except ValueError:
        limit = 0.0
    if not 0.0 < limit < float("inf"):
        raise RenderError(f"{TIMEOUT_VARIABLE} must be a positive number of seconds, got {text!r}")
    return limit


def _backend() -> ModuleType:
    name = chosen_gl()
    if name in DISABLED:
        raise RenderError(f"MUJOCO_GL={name!r} turns rendering off; unset it, or set it to 'egl'")
    if name not in BACKENDS:
        raise RenderError(
            f"MUJOCO_GL={name!r} is not an OpenGL backend; unset it, or set it to {' or '.join(BACKENDS)}"
        )
    os.environ.setdefault(VARIABLE, name)  # makes dm_control use the same backend
    try:
        return importlib.import_module(f"mujoco.{name}")
    except Exception as error:  # a missing library can raise an ImportError, AttributeError or OSError
        remedy = EGL_REMEDY if name == DEFAULT else f"install it, or unset {VARIABLE} to draw with {DEFAULT}"
        raise RenderError(f"cannot load the OpenGL backend {name!r} ({error}); {remedy}") from error


# Each process has only one context, because it has only one EGL display.
_PROCESS = _ProcessContext()
current_context = _PROCESS.current
own = _PROCESS.own
release = _PROCESS.release


def gl_info() -> GlInfo:
    """Return information about the OpenGL driver that this process uses.

    If there is no GPU driver, OpenGL silently falls back to software rendering.

    Raises:
        RenderError: No OpenGL context can be created.
    """
    with current_context():
        gl = importlib.import_module("OpenGL.GL")
        names = (gl.GL_VENDOR, gl.GL_RENDERER, gl.GL_VERSION)
        vendor, renderer, version = (gl.glGetString(name).decode() for name in names)
    return GlInfo(vendor, renderer, version, is_software(renderer))
