"""The report that `mjsim doctor` prints about package versions, package conflicts and OpenGL."""

import importlib
import platform
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from mjsim.support.environment import (
    BACKENDS,
    DISABLED,
    EGL_PACKAGES,
    PACKAGES,
    VARIABLE,
    chosen_gl,
    hidden_package,
    shared_names,
    version_of,
)
from mjsim.values.errors import RenderError

if TYPE_CHECKING:
    from mjsim.render.context import GlInfo

VENDOR_FOLDER = Path("/usr/share/glvnd/egl_vendor.d")
DM_CONTROL = "dm-control"
MODULES = {
    "mujoco": "mujoco",
    DM_CONTROL: "dm_control.mujoco",
    "numpy": "numpy",
    "scipy": "scipy.sparse",
    "numba": "numba",
    "shapely": "shapely",
    "ortools": "ortools",
    "opencv-python-headless": "cv2",
    "pyopengl": "OpenGL",
}  # for each distribution, a module whose import fails if the installed versions are incompatible
# First Python version without wheels of labmaze, which dm-control requires but uses only for mazes.
WITHOUT_LABMAZE = (3, 13)
INSTALL_DM_CONTROL = "pip install --no-deps dm-control"
_REINSTALL = "its version does not fit the others; reinstall with pip install --upgrade mjsim"


@dataclass(frozen=True)
class EnvironmentReport:
    """A report about the Python packages and the OpenGL driver of this machine."""

    python: str  # version of the Python interpreter
    platform: str  # operating system and processor
    versions: Mapping[str, str | None]  # installed version of each distribution, or None if it is missing
    broken: Mapping[str, str]  # error message of each distribution that cannot be imported
    hidden: tuple[str, ...]  # advice about packages that Python does not find or imports from a wrong folder
    cache: str  # folder and size of the compiled-code cache
    egl_vendors: tuple[str, ...]  # file names of the installed EGL vendor files
    gl: "GlInfo | None"  # OpenGL driver, or None if no OpenGL context can be created
    problem: str | None  # reason why no OpenGL context can be created, or None
    advice: tuple[str, ...]  # suggested repairs

    @property
    def usable(self) -> bool:
        """True if all packages required for trials can be imported and OpenGL can draw frames."""
        missing = {name for name, version in self.versions.items() if version is None}
        if sys.version_info >= WITHOUT_LABMAZE:
            missing.discard(DM_CONTROL)  # trials do not need dm-control
        return self.gl is not None and not (missing or self.broken or self.hidden)

    def lines(self) -> tuple[str, ...]:
        rows = [f"python {self.python} on {self.platform}"]
        for name, version in self.versions.items():
            fault = f", cannot be imported ({self.broken[name]})" if name in self.broken else ""
            rows.append(f"{name} {version or 'not installed'}{fault}")
        rows.append(f"compiled code: {self.cache}")
        rows.append(f"EGL vendor files: {', '.join(self.egl_vendors) or 'none'}")
        if self.gl is None:
            rows.append(f"OpenGL: unusable ({self.problem})")
        else:
            kind = "software" if self.gl.software else "hardware"
            rows.append(f"OpenGL: {self.gl.renderer}, {self.gl.vendor}, {self.gl.version} ({kind})")
        return (*rows, *self.hidden, *self.advice)


def environment_report() -> EnvironmentReport:
    """Inspect the packages and the OpenGL driver of this machine. Creates an OpenGL context if possible."""
    gl: GlInfo | None = None
    problem: str | None = None
    try:
        # This import is here so that the report can include an import error of MuJoCo or NumPy.
        from mjsim.render.context import gl_info

        gl = gl_info()
    except RenderError as error:
        problem = str(error)
    except Exception as error:
        problem = f"{type(error).__name__}: {' '.join(str(error).split())}"
    versions = {name: version_of(name) for name in MODULES}
    installed = [name for name, version in versions.items() if version is not None]
    broken = {name: fault for name in installed if (fault := _import_error(MODULES[name]))}
    vendors = egl_vendors()
    return EnvironmentReport(
        python=platform.python_version(),
        platform=f"{platform.system()} {platform.machine()}",
        versions=versions,
        broken=broken,
        hidden=tuple(message for name in PACKAGES if (message := hidden_package(name))),
        cache=_cache(),
        egl_vendors=vendors,
        gl=gl,
        problem=problem,
        advice=(
            *shared_names(),
            *(f"{name} is broken: {_REINSTALL}" for name in broken),
            *advise(versions, vendors, gl),
        ),
    )


def _cache() -> str:
    try:
        from mjsim.support.kernels import cache_base  # imports numba, which may be broken

        folder = cache_base()
        size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    except Exception as error:
        return f"unknown ({type(error).__name__}: {' '.join(str(error).split())})"
    return f"{size / 1e6:.0f} MB in {folder}; it can be deleted, and files unused for 30 days are"


def egl_vendors(folder: Path = VENDOR_FOLDER) -> tuple[str, ...]:
    """Return the names of the EGL vendor files in `folder`, in the order in which EGL tries them."""
    return tuple(sorted(path.name for path in folder.glob("*.json")))


def advise(
    versions: Mapping[str, str | None], vendors: tuple[str, ...], gl: "GlInfo | None"
) -> tuple[str, ...]:
    steps = [_how_to_install(name) for name, version in versions.items() if version is None]
    if gl is None and chosen_gl() not in (*BACKENDS, *DISABLED):
        steps.append(f"no frame can be drawn: unset {VARIABLE}, or set it to {' or '.join(BACKENDS)}")
    elif gl is None:
        steps.append(
            f"no frame can be drawn: on Debian or Ubuntu, apt-get install {' '.join(EGL_PACKAGES)}; "
            "with an NVIDIA GPU also the driver's libnvidia-gl package"
        )
    elif gl.software and any("nvidia" in name for name in vendors):
        steps.append(
            f"an NVIDIA vendor file is present but {gl.renderer} draws: check that the driver is loaded "
            "(nvidia-smi) and that the container may use graphics (NVIDIA_DRIVER_CAPABILITIES=all)"
        )
    elif gl.software:
        steps.append(
            "the CPU draws; with an NVIDIA GPU, 10_nvidia.json is missing from the EGL vendor folder: "
            "install the driver's libnvidia-gl package"
        )
    return tuple(steps)


def _how_to_install(name: str) -> str:
    if name == DM_CONTROL and sys.version_info >= WITHOUT_LABMAZE:
        return f"{name} is missing, which only the native viewer and the Physics adapter need: {INSTALL_DM_CONTROL}"
    return f"{name} is missing: pip install {name}"


def _import_error(module: str) -> str | None:
    try:
        importlib.import_module(module)
    except Exception as error:  # a library built for another NumPy version can raise any type of exception
        return f"{type(error).__name__}: {' '.join(str(error).split())}"
    return None
