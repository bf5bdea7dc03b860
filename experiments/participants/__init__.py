"""Simulated participants. One module each; a module is a participant when it defines `build`."""

import importlib
import pkgutil
from typing import cast

from experiments.errors import ConfigError
from experiments.participants.base import Guidance, Participant, ParticipantFactory, Percept

__all__ = [
    "DEFAULT_PARTICIPANT",
    "Guidance",
    "Participant",
    "ParticipantFactory",
    "Percept",
    "participant",
    "participant_names",
]

DEFAULT_PARTICIPANT = "follower"


def participant_names() -> tuple[str, ...]:
    """Names of the participants that this package holds, sorted."""
    modules = sorted(m.name for m in pkgutil.iter_modules(__path__))
    return tuple(n for n in modules if hasattr(importlib.import_module(f"{__name__}.{n}"), "build"))


def participant(name: str) -> ParticipantFactory:
    """Find a participant by module name, with its parameter after a colon, or one by `package.module:attribute`.

    A module that takes a parameter defines `with_parameter(text)`, which gives the factory.

    Raises:
        ConfigError: There is no such participant, it cannot be loaded or called, or the parameter is none of its.
    """
    module, colon, parameter = name.partition(":")
    if module in participant_names():
        if colon:
            return _with_parameter(module, parameter)
        return cast(ParticipantFactory, importlib.import_module(f"{__name__}.{module}").build)
    if not colon:
        raise ConfigError(
            f"no participant {name!r}; there are {', '.join(participant_names())}, or package.module:attribute"
        )
    return _own_participant(name)


def _own_participant(name: str) -> ParticipantFactory:
    try:
        found = pkgutil.resolve_name(name)
    except Exception as error:  # whatever the module does when it is imported
        raise ConfigError(
            f"cannot load participant {name!r}: {type(error).__name__}: {error}; "
            "modules are looked for in the current folder and among those installed"
        ) from error
    if not callable(found):
        raise ConfigError(
            f"participant {name!r} is a {type(found).__name__}, not a function of a house and a generator"
        )
    return cast(ParticipantFactory, found)


def _with_parameter(name: str, parameter: str) -> ParticipantFactory:
    module = importlib.import_module(f"{__name__}.{name}")
    if not hasattr(module, "with_parameter"):
        raise ConfigError(f"participant {name} takes no parameter, got {parameter!r}")
    factory: ParticipantFactory = module.with_parameter(parameter)
    return factory
