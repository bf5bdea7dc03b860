"""The phases that participants pass through, such as the consent form, the trials and the survey."""

import pkgutil
from collections.abc import Callable, Mapping, Sequence

from experiments.errors import ConfigError
from experiments.record.phases import FLYTHROUGH, STORY, TASK, TRAINING
from experiments.visit import plan as names
from experiments.visit.phases.base import (
    Comprehension,
    Consent,
    FormPhase,
    Phase,
    ResultPhase,
    Story,
    Survey,
    TrialPhase,
)
from experiments.visit.phases.device import DeviceCheck
from experiments.visit.phases.film import Film
from experiments.visit.plan import VisitPlan

KINDS: Mapping[str, Callable[[VisitPlan], Phase]] = {
    names.CONSENT: lambda plan: Consent(plan, names.CONSENT, "consent"),
    names.DEVICE: lambda plan: DeviceCheck(plan, names.DEVICE, "device"),
    STORY: lambda plan: Story(plan, STORY),
    FLYTHROUGH: lambda plan: Film(plan, FLYTHROUGH, "study_film"),
    names.COMPREHENSION: lambda plan: Comprehension(plan, names.COMPREHENSION, "comprehension"),
    TRAINING: lambda plan: TrialPhase(plan, TRAINING),
    TASK: lambda plan: TrialPhase(plan, TASK),
    names.SURVEY: lambda plan: Survey(plan, names.SURVEY),
    names.DEBRIEFING: lambda plan: FormPhase(plan, names.DEBRIEFING),
    names.RESULT: lambda plan: ResultPhase(plan, names.RESULT, "result"),
    names.COMPLETION: lambda plan: FormPhase(plan, names.COMPLETION, "completion"),
}


def phases_of(plan: VisitPlan) -> Sequence[Phase]:
    """Create the phases of a plan, in order. Custom phases have names of the form `package.module:attribute`.

    Raises:
        ConfigError: A phase cannot be loaded or created.
    """
    return [_phase(name, plan) for name in plan.phases]


def _phase(name: str, plan: VisitPlan) -> Phase:
    if name in KINDS:
        return KINDS[name](plan)
    try:
        phase = pkgutil.resolve_name(name)(plan)
    except Exception as error:  # custom phases may raise any exception
        raise ConfigError(f"cannot make phase {name!r}: {type(error).__name__}: {error}") from error
    if not isinstance(phase, Phase):
        raise ConfigError(f"phase {name!r} is {phase!r}, which has not all of name, page and read")
    return phase
