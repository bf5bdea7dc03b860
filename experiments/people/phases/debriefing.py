"""What the study was about."""

from experiments.people.phases.base import FormPhase
from experiments.people.study_file import DEBRIEFING, Study


def build(study: Study) -> FormPhase:
    """The phase."""
    return FormPhase(study, DEBRIEFING)
