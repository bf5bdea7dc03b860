"""What a trial depends on besides its configuration: files, source code and libraries, each by a hash or a version.

A batch that is resumed compares it with what is there now, and runs again what has changed.
"""

import ast
import contextlib
import functools
import hashlib
import importlib.util
import json
import platform
import sysconfig
from collections.abc import Iterator, Mapping
from importlib.machinery import ModuleSpec
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from experiments.familiarisation.story import story_text
from experiments.participants import participant_names
from experiments.runs.phases import STORY
from experiments.trials.trial_config import TrialConfig
from mjsim.model.catalogue import Catalogue

LIBRARIES = ("mujoco", "numpy", "numba", "ortools", "scipy", "shapely")
ROOT = Path(__file__).parents[2]
PACKAGES = ("experiments", "hud", "mjsim", "planner")
# What looks at trials, draws or trains. No record of a trial depends on these.
NO_INFLUENCE = {
    "experiments": (
        "analysis",
        "cli.py",
        "commands",
        "examples",
        "gallery.py",
        "replaying",
        "table.py",
        "warmup.py",
    ),
    "mjsim": ("diagnostics.py", "environments", "render", "testing"),
}

PATHS = ("house", "episode", "story")

Inputs = Mapping[str, str]


def trial_inputs(config: TrialConfig, catalogue: Catalogue) -> dict[str, str]:
    """Hash or version by what it is of; equal configurations with equal inputs give equal records.

    Args:
        config: The trial.
        catalogue: Of its house.

    Raises:
        ConfigError: The story cannot be read.
        OSError: The episode cannot be read.
    """
    inputs = {"house": catalogue.content, "code of mjsim": _code_hash(), **_libraries()}
    if config.episode is not None:
        inputs["episode"] = hashlib.sha256(Path(config.episode).read_bytes()).hexdigest()
    if STORY in config.phase_names:
        text = story_text(None if config.story is None else Path(config.story))
        inputs["story"] = hashlib.sha256(text.encode()).hexdigest()
    return inputs | {f"module {name}": source_hash(name) for name in own_modules(config)}


def fingerprint(config: TrialConfig, inputs: Inputs) -> str:
    """16 hex digits over a trial's options and inputs. Where the files lie does not count, only what is in them."""
    options = {name: value for name, value in config.settings().items() if name not in PATHS}
    return hashlib.sha256(json.dumps([options, sorted(inputs.items())]).encode()).hexdigest()[:16]


def changes(before: Inputs, now: Inputs) -> list[str]:
    """Names of the inputs that differ."""
    return [name for name in dict.fromkeys([*now, *before]) if before.get(name) != now.get(name)]


def own_modules(config: TrialConfig) -> tuple[str, ...]:
    """Names of modules that are not part of this package: participant, condition and planner of one's own."""
    user, shown, planner = (
        name.partition(":") for name in (config.user, config.assistance.partition("-")[0], config.planner)
    )
    named = {module for module, colon, _ in (shown, planner) if colon}
    if user[1] and user[0] not in participant_names():
        named.add(user[0])
    return tuple(sorted(named))


@functools.cache
def source_hash(module: str) -> str:
    """16 hex digits over the source of a module and of all that it imports from its own package and beside it."""
    digest = hashlib.sha256()
    for name, path in sorted(_sources(module)):
        digest.update(name.encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def _sources(module: str) -> set[tuple[str, Path]]:
    found, new = dict[str, Path](), {module}
    while new:
        name = new.pop()
        path = _own_source(name, module.partition(".")[0])
        if path is not None:
            found[name] = path
            new |= {other for other in _imported(name, path) if other not in found}
    return set(found.items())


def _own_source(name: str, package: str) -> Path | None:
    """Source file of a module, None for those of mjsim, of the language and of other installed packages."""
    top = name.partition(".")[0]
    spec = None if top in PACKAGES else _spec(top)
    if spec is None or not (spec.origin or spec.submodule_search_locations):
        return None
    places = [spec.origin or "", *(spec.submodule_search_locations or ())]
    installed = [sysconfig.get_path(kind) for kind in ("stdlib", "platstdlib", "purelib", "platlib")]
    if top != package and any(place.startswith(folder) for place in places for folder in installed):
        return None
    spec = _spec(name)
    source = "" if spec is None else spec.origin or ""
    return Path(source) if source.endswith(".py") else None


def _spec(name: str) -> ModuleSpec | None:
    with contextlib.suppress(ImportError, ValueError, AttributeError):
        return importlib.util.find_spec(name)
    return None


def _imported(name: str, path: Path) -> Iterator[str]:
    """Modules that a module may import, its parent packages too."""
    parent = name if path.name == "__init__.py" else name.rpartition(".")[0]
    if "." in name:
        yield name.rpartition(".")[0]
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = parent.split(".")[: len(parent.split(".")) - node.level + 1] if node.level else []
            base = ".".join([*above, *([node.module] if node.module else [])])
            yield base
            yield from (f"{base}.{alias.name}" for alias in node.names)


@functools.cache
def _code_hash() -> str:
    digest = hashlib.sha256()
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            place = path.relative_to(ROOT / package)
            if place.parts[0] not in NO_INFLUENCE.get(package, ()):
                digest.update(f"{package}/{place.as_posix()}".encode() + path.read_bytes())
    return digest.hexdigest()[:16]


@functools.cache
def _libraries() -> dict[str, str]:
    found = {"python": platform.python_version(), "machine": platform.machine()}
    for name in ("mjsim", *LIBRARIES):
        with contextlib.suppress(PackageNotFoundError):
            found[name] = version(name)
    return found
