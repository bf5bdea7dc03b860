"""The OpenGL context: one per process, made on first use, current only while something draws.

EGL's display is a property of the process, so the context is too. Every use takes a lock, makes the context
current in the calling thread and afterwards restores what was current before; hence any thread may draw, and
other libraries' contexts in the same thread stay intact. One such switch costs about 0.03 ms.
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
MAX_START_TIME = 60.0  # s; the slowest drivers take a few
_MAIN_THREAD_ONLY = ("glfw", "cgl")
_SOFTWARE_RENDERERS = ("llvmpipe", "softpipe", "swrast", "software", "swiftshader")


@dataclass(frozen=True)
class GlInfo:
    """The OpenGL driver in use."""

    vendor: str  # GL_VENDOR
    renderer: str  # GL_RENDERER, the device or the software rasteriser
    version: str  # GL_VERSION
    software: bool  # whether the CPU does the drawing


def is_software(renderer: str) -> bool:
    """Whether a GL_RENDERER string names a rasteriser that runs on the CPU."""
    return any(name in renderer.lower() for name in _SOFTWARE_RENDERERS)


class _ProcessContext:
    """Owns the process's GL context and the MuJoCo contexts that live in it."""

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
            if self._depth:  # already current: a nested use in the same thread
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
        """Register a MuJoCo context, to be freed by `release` or when the process ends."""
        with self._lock:
            self._owned[id(mujoco_context)] = mujoco_context
            return id(mujoco_context)

    def release(self, key: int) -> None:
        """Free a MuJoCo context; does nothing when that was done before."""
        with self._lock:
            mujoco_context = self._owned.pop(key, None)
            # A forked child must not touch the parent's driver threads.
            if mujoco_context is None or self._gl is None or self._pid != os.getpid():
                return
            with self.current():
                mujoco_context.free()

    def close(self) -> None:
        """Free everything; runs at exit before MuJoCo's own hook terminates the display."""
        with self._lock:
            if self._gl is None or self._pid != os.getpid():
                return
            # Hooks run last in, first out: dm_control, if imported later, has terminated the display that all share.
            if self._display_lives():
                for key in list(self._owned):
                    self.release(key)
                self._gl.free()
            else:
                self._gl._context = None  # gone with the display; the finalizer would destroy it again
            self._gl = None

    def _display_lives(self) -> bool:
        try:
            with self.current():
                return True
        except Exception:  # PyOpenGL's errors are of many types, and what is wrong does not matter here
            return False

    def _ensure(self) -> None:
        if self._failure is not None:  # a driver that failed once says less the second time, or hangs again
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
        # Ours is current here if a signal interrupted an earlier drawing just before it was released.
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
    """Drivers may fail at any moment: a GPU is lost, memory runs out."""
    try:
        yield
    except (mujoco.FatalError, *_opengl_errors()) as error:
        raise RenderError(
            f"OpenGL failed while drawing ({' '.join(str(error).split())}); {EGL_REMEDY}"
        ) from error


def _opengl_errors() -> tuple[type[Exception], ...]:
    """PyOpenGL's errors; it is imported only where something is drawn."""
    module = sys.modules.get("OpenGL.error")
    return () if module is None else (module.Error,)


def _start() -> tuple[ModuleType, Any]:
    """The backend and a new context of it, or an error when the driver gives no answer in time.

    A driver that hangs cannot be interrupted, so it is started in a thread, which is abandoned if it hangs.
    """
    limit = _time_limit()
    answers: queue.SimpleQueue[tuple[ModuleType, Any] | RenderError] = queue.SimpleQueue()

    def start() -> None:
        try:
            module = _backend()
            answers.put((module, module.GLContext(1, 1)))
        except RenderError as error:
            answers.put(error)
        except Exception as error:  # drivers and PyOpenGL raise many unrelated types here
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
            f"MUJOCO_GL={name!r} is no OpenGL backend; unset it, or set it to {' or '.join(BACKENDS)}"
        )
    os.environ.setdefault(VARIABLE, name)  # dm_control, if it is used, has to draw with the same
    try:
        return importlib.import_module(f"mujoco.{name}")
    except Exception as error:  # a missing library surfaces as ImportError, AttributeError or OSError
        remedy = EGL_REMEDY if name == DEFAULT else f"install it, or unset {VARIABLE} to draw with {DEFAULT}"
        raise RenderError(f"cannot load the OpenGL backend {name!r} ({error}); {remedy}") from error


# EGL keeps one display per process, and so the owner of the context is one object per process as well.
_PROCESS = _ProcessContext()
current_context = _PROCESS.current
own = _PROCESS.own
release = _PROCESS.release


def gl_info() -> GlInfo:
    """Vendor, renderer and version of the OpenGL that draws in this process.

    A missing GPU driver falls back to software silently, so records of a run should keep this.

    Raises:
        RenderError: No OpenGL context can be made.
    """
    with current_context():
        gl = importlib.import_module("OpenGL.GL")
        names = (gl.GL_VENDOR, gl.GL_RENDERER, gl.GL_VERSION)
        vendor, renderer, version = (gl.glGetString(name).decode() for name in names)
    return GlInfo(vendor, renderer, version, is_software(renderer))
