"""Check a study file for problems before participants are recruited."""

from collections.abc import Iterable, Iterator

from experiments.errors import ConfigError
from experiments.study.file import Study
from experiments.study.recruitment import recruiter
from experiments.trials.toml_file import TomlFile
from experiments.visit.plan import COMPREHENSION, CONSENT

PAID = ("prolific", "connect", "external-question")  # platforms that pay participants
EXAMPLES = ("your institution", "example.org", "example.com")
# Content of a consent text, by name in the section `consent_check` of the texts
NAMED = {
    "legal_basis": "the legal basis",
    "retention": "how long data are kept",
    "rights": "the participant's rights",
    "stopping": "the pay of a participant who stops early",
}


# The key of the setting in the table `[study]` that causes a problem, and a description of the problem
Problem = tuple[str, str]


def problems_of_file(study: Study) -> Iterator[Problem]:
    """Yield all problems that can be found without a simulation of the study."""
    settings, pay = study.settings, study.settings.pay
    if "@" not in settings.contact or any(word in settings.contact for word in EXAMPLES):
        yield "contact", f"contact is {settings.contact!r}; participants need a working address"
    if any(word in settings.institution for word in EXAMPLES):
        yield "institution", f"institution is {settings.institution!r}; name your institution"
    if CONSENT not in settings.phases:
        yield "phases", "participants are not asked for consent; add the phase consent"
    elif lacks := _lacks(study):
        yield "texts", f"the consent text does not name {', '.join(lacks)}; add a sentence to [consent]"
    try:
        recruiter(settings.recruitment)
    except ConfigError as error:
        yield "recruitment", str(error)
    if not pay.reward and settings.recruitment.platform in PAID:
        yield "pay", f"reward is 0; people of {settings.recruitment.platform} are paid"
    if not pay.screen_out and settings.recruitment.platform in PAID:
        yield (
            "pay.screen_out",
            "screen_out is 0.00, so people who are screened out work without pay; set an amount above 0",
        )
    hourly = 60.0 * pay.reward / settings.minutes
    if hourly < pay.wage:
        yield (
            "pay.reward",
            f"{pay.reward:.2f} {pay.currency} for {settings.minutes} minutes are {hourly:.2f} an hour, below the wage "
            f"of {pay.wage:.2f}",
        )
    if COMPREHENSION in settings.phases and all(i.right is None for i in study.texts[COMPREHENSION].items):
        yield "phases", "no question of the comprehension check has a right answer; give one of them `right`"
    if few := next((cell for cell in study.cells if len(cell.trials) < 2), None):
        yield "name", f"the cell {few.label} has one person; a cell needs two or more to be compared"


def _lacks(study: Study) -> list[str]:
    """Return what the consent text does not name."""
    settings, text = study.settings, "\n".join(study.texts[CONSENT].paragraphs()).casefold()
    words = {about: study.texts["consent_check"][name].split(", ") for name, about in NAMED.items()}
    words |= {"the controller": [settings.institution], "the address for questions": [settings.contact]}
    return [about for about, any_of in words.items() if not any(word.casefold() in text for word in any_of)]


def problems_of_length(study: Study, shortest: float, longest: float) -> Iterator[Problem]:
    """Yield a problem if the announced duration of a study differs too much from the expected duration."""
    told, low, high = study.settings.minutes, shortest / 60, longest / 60
    if 0.8 * low <= told <= 2.5 * high and told >= 0.8 * high:
        return
    span = f"{low:.0f}" if round(low) == round(high) else f"{low:.0f} to {high:.0f}"
    yield "minutes", f"minutes is {told}, but the study is expected to take {span} with simulated people"


def located(study: Study, problems: Iterable[Problem]) -> list[str]:
    file = TomlFile.read(study.path, "study")
    lines = [(file.line(f"study.{key}") or 1, text) for key, text in problems]
    return [f"{study.path}, line {line}: {words}" for line, words in sorted(lines)]
