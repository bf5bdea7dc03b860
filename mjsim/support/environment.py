"""Checks of the Python environment: conflicting packages and the OpenGL backend."""

import importlib.util
import os
import sys
from importlib import metadata
from pathlib import Path

PACKAGES = ("planner", "hud", "experiments")
VARIABLE = "MUJOCO_GL"
POSTPONED = "MJSIM_GL"  # environment variable that stores the value of MUJOCO_GL before `postpone_gl`
BACKENDS = ("egl", "osmesa", "glfw", "cgl")
EGL_PACKAGES = ("libegl1", "libgl1", "libgles2", "libegl-mesa0", "libgl1-mesa-dri")
DISABLED = ("disable", "disabled", "off", "false", "0")
ENABLED = ("enable", "enabled", "on", "true", "1")  # values of MUJOCO_GL that let MuJoCo choose a backend
DEFAULT = "egl"


def hidden_package(name: str) -> str | None:
    """Return how to correct the import of a package, or None if Python finds this project's package."""
    own = Path(__file__).resolve().parents[2] / name
    spec = importlib.util.find_spec(name)
    folders = list(spec.submodule_search_locations or ()) if spec else []
    if not folders:
        return f"the package {name} is missing at {own}: reinstall mjsim"
    found = Path(folders[0]).resolve()
    if found == own:
        return None
    return (
        f"Python imports {name} from {found} instead of {own}: rename that folder, or take {found.parent} off "
        "PYTHONPATH and sys.path"
    )


def shared_names() -> tuple[str, ...]:
    """Return advice for each other distribution that installs a package with one of this project's names."""
    installed = metadata.packages_distributions()
    return tuple(
        f"the distribution {other} installs a package {name} too: pip uninstall {other}, or install mjsim in an "
        "environment of its own"
        for name in PACKAGES
        for other in sorted(set(installed.get(name, ())) - {"mjsim"})
    )


def postpone_gl() -> None:
    """Prevent MuJoCo from loading OpenGL at import, in this process and its children.

    If `MUJOCO_GL` is unset, MuJoCo would load GLFW, which starts another Python process to inspect its library.
    OpenGL is loaded when something is drawn.
    """
    choice = os.environ.get(VARIABLE, "") or DEFAULT
    if choice.lower().strip() not in DISABLED and "mujoco" not in sys.modules:
        os.environ[POSTPONED], os.environ[VARIABLE] = choice, DISABLED[0]


def chosen_gl() -> str:
    """Return the OpenGL backend that was requested before `postpone_gl`, in lower case."""
    choice = (os.environ.get(POSTPONED) or os.environ.get(VARIABLE) or DEFAULT).lower().strip()
    return DEFAULT if choice in ENABLED else choice
