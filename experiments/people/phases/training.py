"""The training, which is played."""

from experiments.people.phases.played import Played
from experiments.people.study_file import Study
from experiments.record.phases import TRAINING


def build(study: Study) -> Played:
    """The phase."""
    return Played(study, TRAINING)
