"""The phases of a study: what a participant goes through, one after the other."""

import pkgutil
from collections.abc import Callable, Mapping, Sequence

from experiments.errors import ConfigError
from experiments.people import study_file as names
from experiments.people.phases.base import FormPhase, Phase, Story
from experiments.people.phases.comprehension import Comprehension
from experiments.people.phases.consent import Consent
from experiments.people.phases.device import DeviceCheck
from experiments.people.phases.played import Played
from experiments.people.phases.survey import Survey
from experiments.people.study_file import Study
from experiments.record.phases import FLYTHROUGH, STORY, TASK, TRAINING

KINDS: Mapping[str, Callable[[Study], Phase]] = {
    names.CONSENT: lambda study: Consent(study, names.CONSENT, "consent"),
    names.DEVICE: lambda study: DeviceCheck(study, names.DEVICE, "device"),
    STORY: lambda study: Story(study, STORY),
    FLYTHROUGH: lambda study: FormPhase(study, FLYTHROUGH, "study_film"),
    names.COMPREHENSION: lambda study: Comprehension(study, names.COMPREHENSION, "comprehension"),
    TRAINING: lambda study: Played(study, TRAINING),
    TASK: lambda study: Played(study, TASK),
    names.SURVEY: lambda study: Survey(study, names.SURVEY),
    names.DEBRIEFING: lambda study: FormPhase(study, names.DEBRIEFING),
    names.COMPLETION: lambda study: FormPhase(study, names.COMPLETION, "completion"),
}


def phases_of_study(study: Study) -> Sequence[Phase]:
    """The phases of a study, in order; own ones are given as `package.module:attribute` of what makes one.

    Raises:
        ConfigError: One cannot be loaded or made.
    """
    return [_phase(name, study) for name in study.settings.phases]


def _phase(name: str, study: Study) -> Phase:
    if name in KINDS:
        return KINDS[name](study)
    try:
        phase = pkgutil.resolve_name(name)(study)
    except Exception as error:  # user code may raise anything
        raise ConfigError(f"cannot make phase {name!r}: {type(error).__name__}: {error}") from error
    if not isinstance(phase, Phase):
        raise ConfigError(f"phase {name!r} is {phase!r}, which has not all of name, page and read")
    return phase
