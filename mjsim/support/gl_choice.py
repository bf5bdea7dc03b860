"""Which OpenGL was asked for. MuJoCo loads that at its import, so a command that draws nothing would need it too."""

import os
import sys

VARIABLE = "MUJOCO_GL"
POSTPONED = "MJSIM_GL"  # what `VARIABLE` was
BACKENDS = ("egl", "osmesa", "glfw", "cgl")
EGL_PACKAGES = ("libegl1", "libgl1", "libgles2", "libegl-mesa0", "libgl1-mesa-dri")
DISABLED = ("disable", "disabled", "off", "false", "0")
ENABLED = ("enable", "enabled", "on", "true", "1")  # MuJoCo's words for: choose one
DEFAULT = "egl"


def postpone_gl() -> None:
    """Keep MuJoCo, in this process and its children, from loading OpenGL before something is drawn.

    Without a choice it would load GLFW, which starts another Python to look at its library.
    """
    choice = os.environ.get(VARIABLE, "") or DEFAULT
    if choice.lower().strip() not in DISABLED and "mujoco" not in sys.modules:
        os.environ[POSTPONED], os.environ[VARIABLE] = choice, DISABLED[0]


def chosen_gl() -> str:
    """The backend that was asked for, in lower case."""
    choice = (os.environ.get(POSTPONED) or os.environ.get(VARIABLE) or DEFAULT).lower().strip()
    return DEFAULT if choice in ENABLED else choice
