"""Compute hashes and versions of the files, source code and libraries on which a trial depends.

If a batch is resumed, trials are rerun if any of these hashes and versions has changed.
"""

import functools
import hashlib
import importlib.util
import json
import platform
from collections.abc import Iterable, Mapping
from pathlib import Path

from experiments.participants.registry import participant_names
from experiments.record.phases import STORY
from experiments.session.familiarise import story_text
from experiments.trials.trial_config import PATHS, TrialConfig
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.support.environment import version_of
from mjsim.support.files import PACKAGES, digest_of, read_bytes, source_digest

LIBRARIES = ("mujoco", "numpy", "numba", "llvmlite", "ortools", "scipy", "shapely")
# Source files that can change the record of a trial. Code that only reads records is not included.
CODE = (
    "hud",
    "planner",
    "mjsim",
    *(f"experiments/{room}" for room in ("house.py", "participants", "record", "session", "trials")),
)

Inputs = Mapping[str, str]


def trial_inputs(config: TrialConfig, catalogue: Catalogue) -> dict[str, str]:
    """Return the hashes and versions of everything on which a trial depends in addition to its settings, by name."""
    inputs = {"house": catalogue.content, **code_versions()}
    if config.episode is not None:
        inputs["episode"] = hashlib.sha256(read_bytes(Path(config.episode))).hexdigest()
    if STORY in config.phase_names:
        text = story_text(None if config.story is None else Path(config.story))
        inputs["story"] = hashlib.sha256(text.encode()).hexdigest()
    return inputs | code_versions(plugins(config))


def code_versions(modules: Iterable[str] = ()) -> dict[str, str]:
    """Return hashes and versions of this package, of its libraries and of additional modules."""
    user_code = {f"module {name}": plugin_digest(name) for name in modules}
    return {"code of mjsim": source_digest(*CODE), **_libraries(), **user_code}


def fingerprint(config: TrialConfig, inputs: Inputs) -> str:
    """Hash the settings and inputs of a trial to 16 hex digits. The hash does not depend on file paths."""
    settings = {name: value for name, value in config.settings().items() if name not in PATHS}
    return hashlib.sha256(json.dumps([settings, sorted(inputs.items())]).encode()).hexdigest()[:16]


def changes(before: Inputs, now: Inputs) -> list[str]:
    return [name for name in dict.fromkeys([*now, *before]) if before.get(name) != now.get(name)]


def plugins(config: TrialConfig) -> tuple[str, ...]:
    """Return the modules of custom participants, conditions and planners that a trial uses."""
    conditions = (config.assistance, config.training_assistance)
    named = (config.user, config.planner, *(name.partition("-")[0] for name in conditions))
    modules = {module for module, colon, _ in (name.partition(":") for name in named) if colon}
    packages = {*PACKAGES, *participant_names()}
    return tuple(sorted(module for module in modules if module.partition(".")[0] not in packages))


@functools.cache
def plugin_digest(module: str) -> str:
    """Hash the source code of a module or of its top-level package to 16 hex digits."""
    spec = importlib.util.find_spec(module.partition(".")[0])
    if spec is None:
        return ""
    paths = spec.submodule_search_locations or ([spec.origin] if spec.origin else [])
    return digest_of(*map(Path, paths))


@functools.cache
def _libraries() -> dict[str, str]:
    installed = {name: found for name in ("mjsim", *LIBRARIES) if (found := version_of(name)) is not None}
    return {"python": platform.python_version(), "machine": platform.machine(), **installed}
