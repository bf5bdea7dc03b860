"""Look up participants by name, in this package or in user code."""

import functools
import importlib
import pkgutil
import re
from pathlib import Path
from typing import TYPE_CHECKING, cast

from experiments.errors import ConfigError

if TYPE_CHECKING:  # the command line imports this module and must not load the simulator
    from experiments.participants.base import ParticipantFactory

DEFAULT_PARTICIPANT = "follower"
_BUILDS = re.compile(r"^(def build\(|build = )", re.MULTILINE)


@functools.cache
def participant_names() -> tuple[str, ...]:
    """Return the sorted names of the participants in this package, without importing their modules."""
    folder = Path(__file__).parent
    sources = [*folder.glob("[!_]*.py"), *folder.glob("*/__init__.py")]
    found = [path for path in sources if _BUILDS.search(path.read_text(encoding="utf-8"))]
    return tuple(sorted(path.parent.name if path.stem == "__init__" else path.stem for path in found))


def participant(name: str) -> "ParticipantFactory":
    """Return the factory of a participant, given a name or `package.module:attribute`.

    If a module defines `with_parameter(text)`, a parameter may follow the name after a colon. Raises ConfigError if the
    participant is unknown, cannot be loaded or called, or accepts no parameter.
    """
    module, colon, parameter = name.partition(":")
    if module in participant_names():
        if colon:
            return _with_parameter(module, parameter)
        return cast("ParticipantFactory", importlib.import_module(f"{__package__}.{module}").build)
    if not colon:
        raise ConfigError(
            f"no participant {name!r}; there are {', '.join(participant_names())}, or package.module:attribute"
        )
    return _own_participant(name)


def _own_participant(name: str) -> "ParticipantFactory":
    try:
        found = pkgutil.resolve_name(name)
    except (Exception, SystemExit) as error:  # user code may raise any exception at import
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
    module = importlib.import_module(f"{__package__}.{name}")
    if not hasattr(module, "with_parameter"):
        raise ConfigError(f"participant {name} takes no parameter, got {parameter!r}")
    factory: ParticipantFactory = module.with_parameter(parameter)
    return factory
