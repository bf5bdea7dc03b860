"""The survey: items on a scale, demographics, free text (PAPER section 6)."""

from experiments.people.phases.base import FormPhase
from experiments.people.study_file import SURVEY, Study


def build(study: Study) -> FormPhase:
    """The phase."""
    return FormPhase(study, SURVEY)
