"""Recruitment: one module for each platform, behind one interface."""

from experiments.people.recruitment.base import Recruiter
from experiments.people.recruitment.link import OpenLink
from experiments.people.study_file import Recruitment


def recruiter(settings: Recruitment) -> Recruiter:
    """The platform of a study."""
    return OpenLink(settings.platform, settings.completed)
