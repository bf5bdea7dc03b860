"""The film of the house (PAPER section 7)."""

from experiments.people.phases.base import FormPhase
from experiments.people.study_file import Study
from experiments.record.phases import FLYTHROUGH


def build(study: Study) -> FormPhase:
    """The phase."""
    return FormPhase(study, FLYTHROUGH, "study_film")
