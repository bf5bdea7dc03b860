"""Check for conflicting Python packages, and choose the OpenGL backend."""

import importlib.util
import os
import sys
from importlib import metadata
from pathlib import Path

PACKAGES = ("planner", "hud", "experiments")
VARIABLE = "MUJOCO_GL"
POSTPONED = "MJSIM_GL"  # environment variable with the original value of MUJOCO_GL
BACKENDS = ("egl", "osmesa", "glfw", "cgl")
EGL_PACKAGES = ("libegl1", "libgl1", "libgles2", "libegl-mesa0", "libgl1-mesa-dri")
DISABLED = ("disable", "disabled", "off", "false", "0")
ENABLED = ("enable", "enabled", "on", "true", "1")  # values of MUJOCO_GL with which MuJoCo chooses a backend
DEFAULT = "egl"


def version_of(distribution: str) -> str | None:
    """Return the version of a distribution, or None if it is not installed."""
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return None


def hidden_package(name: str) -> str | None:
    """Return an error message if another package hides this project's package, or None."""
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
    """Return a warning for each distribution whose packages have the same names as those of this project."""
    installed = metadata.packages_distributions()
    return tuple(
        f"the distribution {other} installs a package {name} too: pip uninstall {other}, or install mjsim in an "
        "environment of its own"
        for name in PACKAGES
        for other in sorted(set(installed.get(name, ())) - {"mjsim"})
    )


def postpone_gl() -> None:
    """Prevent MuJoCo from loading OpenGL when it is imported, in this process and its child processes.

    Without this function and `MUJOCO_GL`, MuJoCo would load GLFW, which starts another Python process to
    inspect its library. With it, OpenGL is loaded when the first image is drawn.
    """
    choice = os.environ.get(VARIABLE, "") or DEFAULT
    if choice.lower().strip() not in DISABLED and "mujoco" not in sys.modules:
        os.environ[POSTPONED], os.environ[VARIABLE] = choice, DISABLED[0]


def chosen_gl() -> str:
    """Return the name of the OpenGL backend that `MUJOCO_GL` requested, or the default backend."""
    choice = (os.environ.get(POSTPONED) or os.environ.get(VARIABLE) or DEFAULT).lower().strip()
    return DEFAULT if choice in ENABLED else choice
