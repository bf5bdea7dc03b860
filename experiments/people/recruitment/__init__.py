"""Recruitment: one module for each platform, behind one interface for arrival and one for paying."""

from collections.abc import Mapping, Sequence

from experiments.errors import ConfigError
from experiments.people.recruitment.base import Recruiter
from experiments.people.recruitment.connect import Connect, ConnectPayer
from experiments.people.recruitment.external_question import ExternalQuestion, ExternalQuestionPayer
from experiments.people.recruitment.link import OpenLink
from experiments.people.recruitment.payer import Payer
from experiments.people.recruitment.prolific import Prolific, ProlificPayer
from experiments.people.study_file import Recruitment

# Settings without which people of a platform cannot be served.
NEEDED: Mapping[str, Sequence[str]] = {
    "prolific": ("completed", "screened_out", "no_consent"),
    "connect": ("completed",),
    "external-question": ("sites",),
}


def recruiter(settings: Recruitment) -> Recruiter:
    """The platform of a study, from which people come and to which they return.

    Raises:
        ConfigError: A setting that the platform needs is missing.
    """
    for name in NEEDED.get(settings.platform, ()):
        if not getattr(settings, name):
            raise ConfigError(f"study.recruitment.{name} is empty; people of {settings.platform} need it")
    match settings.platform:
        case "link" | "lab":
            return OpenLink(settings.platform, settings.completed)
        case "prolific":
            return Prolific(settings)
        case "connect":
            return Connect(settings)
        case "external-question":
            return ExternalQuestion(settings)


def payer(settings: Recruitment) -> Payer:
    """The client through which the platform of a study pays.

    Raises:
        ConfigError: The platform pays nobody, or the environment lacks its secret.
    """
    match settings.platform:
        case "prolific":
            return ProlificPayer(settings)
        case "connect":
            return ConnectPayer(settings)
        case "external-question":
            return ExternalQuestionPayer(settings)
    raise ConfigError(
        f"study.recruitment.platform is {settings.platform!r}, which pays nobody; pay by hand and note it with --paid"
    )
