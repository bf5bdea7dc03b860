"""The phases of a study: what a participant goes through, one after the other."""

import importlib
import pkgutil
from collections.abc import Sequence

from experiments.errors import ConfigError
from experiments.people.phases.base import Phase
from experiments.people.study_file import PHASES, Study


def phases_of_study(study: Study) -> Sequence[Phase]:
    """The phases of a study, in order; own ones are given as `package.module:attribute` of what makes one.

    Raises:
        ConfigError: One cannot be loaded or made.
    """
    return [_phase(name, study) for name in study.settings.phases]


def _phase(name: str, study: Study) -> Phase:
    if name in PHASES:
        made: Phase = importlib.import_module(f"{__name__}.{name}").build(study)
        return made
    try:
        phase = pkgutil.resolve_name(name)(study)
    except Exception as error:  # user code may raise anything
        raise ConfigError(f"cannot make phase {name!r}: {type(error).__name__}: {error}") from error
    if not isinstance(phase, Phase):
        raise ConfigError(f"phase {name!r} is {phase!r}, which has not all of name, page and read")
    return phase
