"""Simulated participants, one module each, and what they share: percept, decisions, walks.

Serves sessions, and authors of participants: a module of this package with `build` is a choice of `--user`.
"""

import functools
import importlib
import pkgutil
import re
from pathlib import Path
from typing import TYPE_CHECKING, cast

from experiments.errors import ConfigError
from mjsim.support.lazy_names import lazy_names

__all__ = [
    "Choice",
    "Follower",
    "FullTurn",
    "Guidance",
    "Nearest",
    "Parameter",
    "Participant",
    "ParticipantFactory",
    "Percept",
    "Point",
    "VisitExecutor",
    "participant",
    "participant_names",
    "positions_of",
]

if TYPE_CHECKING:  # options of commands name participants, and must not load the simulator
    from experiments.participants.base import (
        Choice,
        Guidance,
        Participant,
        ParticipantFactory,
        Percept,
        Point,
        positions_of,
    )
    from experiments.participants.behaviour import Parameter
    from experiments.participants.follower import Follower
    from experiments.participants.looking import FullTurn
    from experiments.participants.nearest import Nearest
    from experiments.participants.visit_executor import VisitExecutor
else:  # hidden from type checkers, which would otherwise accept any name
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "base": (
                "Choice",
                "Guidance",
                "Participant",
                "ParticipantFactory",
                "Percept",
                "Point",
                "positions_of",
            ),
            "behaviour": ("Parameter",),
            "follower": ("Follower",),
            "looking": ("FullTurn",),
            "nearest": ("Nearest",),
            "visit_executor": ("VisitExecutor",),
        },
    )

DEFAULT_PARTICIPANT = "follower"
_BUILDS = re.compile(r"^(def build\(|build = )", re.MULTILINE)


@functools.cache
def participant_names() -> tuple[str, ...]:
    """Names of the participants that this package holds, sorted; nothing is imported to find them."""
    folder = Path(__file__).parent
    sources = [*folder.glob("[!_]*.py"), *folder.glob("*/__init__.py")]
    found = [path for path in sources if _BUILDS.search(path.read_text(encoding="utf-8"))]
    return tuple(sorted(path.parent.name if path.stem == "__init__" else path.stem for path in found))


def participant(name: str) -> "ParticipantFactory":
    """Find a participant by module name, with its parameter after a colon, or one by `package.module:attribute`.

    A module that takes a parameter defines `with_parameter(text)`, which gives the factory.

    Raises:
        ConfigError: There is no such participant, it cannot be loaded or called, or the parameter is none of its.
    """
    module, colon, parameter = name.partition(":")
    if module in participant_names():
        if colon:
            return _with_parameter(module, parameter)
        return cast("ParticipantFactory", importlib.import_module(f"{__name__}.{module}").build)
    if not colon:
        raise ConfigError(
            f"no participant {name!r}; there are {', '.join(participant_names())}, or package.module:attribute"
        )
    return _own_participant(name)


def _own_participant(name: str) -> "ParticipantFactory":
    try:
        found = pkgutil.resolve_name(name)
    except (Exception, SystemExit) as error:  # user code may raise anything on import
        raise ConfigError(
            f"cannot load participant {name!r}: {type(error).__name__}: {error}; "
            "modules are looked for in the current folder and among those installed"
        ) from error
    if not callable(found):
        raise ConfigError(
            f"participant {name!r} is a {type(found).__name__}, not a function of a house and a generator"
        )
    return cast("ParticipantFactory", found)


def _with_parameter(name: str, parameter: str) -> "ParticipantFactory":
    module = importlib.import_module(f"{__name__}.{name}")
    if not hasattr(module, "with_parameter"):
        raise ConfigError(f"participant {name} takes no parameter, got {parameter!r}")
    factory: ParticipantFactory = module.with_parameter(parameter)
    return factory
