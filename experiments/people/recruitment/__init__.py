"""Recruitment: one module for each platform, behind one interface."""

from experiments.errors import ConfigError
from experiments.people.recruitment.base import Recruiter
from experiments.people.recruitment.link import OpenLink
from experiments.people.recruitment.prolific import Prolific
from experiments.people.study_file import Recruitment


def recruiter(settings: Recruitment) -> Recruiter:
    """The platform of a study.

    Raises:
        ConfigError: The settings lack what the platform needs, or there is no such platform yet.
    """
    match settings.platform:
        case "link" | "lab":
            return OpenLink(settings.platform, settings.completed)
        case "prolific":
            return Prolific(settings)
    raise ConfigError(
        f"study.recruitment.platform is {settings.platform!r}, which cannot be served yet; use link, lab or prolific"
    )
