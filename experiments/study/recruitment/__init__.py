"""Recruit and pay participants through recruitment platforms, with one module per platform."""

from collections.abc import Mapping, Sequence

from experiments.errors import ConfigError
from experiments.study.file import Recruitment, StudySettings
from experiments.study.payments.platform import Payer
from experiments.study.recruitment.connect import Connect, ConnectPayer
from experiments.study.recruitment.external_question import ExternalQuestion, ExternalQuestionPayer
from experiments.study.recruitment.prolific import Prolific, ProlificPayer
from experiments.visit.recruiter import OpenLink, Recruiter

# Keys in the table `[study.recruitment]` that each platform requires
NEEDED: Mapping[str, Sequence[str]] = {
    "prolific": ("completed", "screened_out", "no_consent"),
    "connect": ("completed",),
    "external-question": ("sites",),
}
PAY_DOLLARS = ("connect", "external-question")


def recruiter(settings: Recruitment) -> Recruiter:
    """Create a recruiter, which handles participants who arrive from the recruitment platform.

    Raises:
        ConfigError: The study file lacks a setting that the platform requires.
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


def payer(settings: StudySettings) -> Payer:
    """Create a client that makes payments through the study's recruitment platform.

    Raises:
        ConfigError: The platform cannot pay, does not support the currency, or has no secret in the environment.
    """
    recruitment, currency = settings.recruitment, settings.pay.currency
    if recruitment.platform in PAY_DOLLARS and currency != "USD":
        raise ConfigError(f"study.pay.currency is {currency!r}; {recruitment.platform} pays in USD")
    match recruitment.platform:
        case "prolific":
            return ProlificPayer(recruitment)
        case "connect":
            return ConnectPayer(recruitment)
        case "external-question":
            return ExternalQuestionPayer(recruitment)
    raise ConfigError(
        f"study.recruitment.platform {recruitment.platform!r} makes no payments; pay by hand and record it (--paid)"
    )
