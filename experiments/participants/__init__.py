"""Simulated participants. One module each; a module is a participant when it defines `build`."""

import importlib
import pkgutil

from experiments.errors import ConfigError
from experiments.participants.base import Guidance, Participant, ParticipantFactory, Percept

__all__ = ["Guidance", "Participant", "ParticipantFactory", "Percept", "participant", "participant_names"]

# PAPER section 5: what each condition lets a cooperative person do.
DEFAULT_FOR_ASSISTANCE = {"optimal": "follower", "highlight": "nearest", "none": "searcher"}


def participant_names() -> tuple[str, ...]:
    """Names of the participants that this package holds, sorted."""
    modules = sorted(m.name for m in pkgutil.iter_modules(__path__))
    return tuple(n for n in modules if hasattr(importlib.import_module(f"{__name__}.{n}"), "build"))


def participant(name: str) -> ParticipantFactory:
    """Find a participant by module name, with its parameter after a colon, or one by `package.module:attribute`.

    A module that takes a parameter defines `with_parameter(text)`, which gives the factory.

    Raises:
        ConfigError: There is no such participant, or the parameter is none of its.
    """
    module_name, colon, attribute = name.partition(":")
    if colon and module_name in participant_names():
        return _with_parameter(module_name, attribute)
    if not colon:
        if name not in participant_names():
            raise ConfigError(f"no participant {name!r}; there are {', '.join(participant_names())}")
        module_name, attribute = f"{__name__}.{name}", "build"
    try:
        factory: ParticipantFactory = getattr(importlib.import_module(module_name), attribute)
    except (ImportError, AttributeError) as error:
        raise ConfigError(f"cannot load participant {name!r}: {error}") from error
    return factory


def _with_parameter(name: str, parameter: str) -> ParticipantFactory:
    module = importlib.import_module(f"{__name__}.{name}")
    if not hasattr(module, "with_parameter"):
        raise ConfigError(f"participant {name} takes no parameter, got {parameter!r}")
    factory: ParticipantFactory = module.with_parameter(parameter)
    return factory


def default_participant(assistance: str) -> str:
    """Name of the participant that makes the most of an assistance condition."""
    return DEFAULT_FOR_ASSISTANCE.get(
        assistance.partition("-")[0], "follower"
    )  # less the condition's options
