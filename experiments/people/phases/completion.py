"""The end: thanks, and the way back to where the person came from."""

from experiments.people.phases.base import FormPhase
from experiments.people.study_file import COMPLETION, Study


def build(study: Study) -> FormPhase:
    """The phase."""
    return FormPhase(study, COMPLETION, "completion")
