"""The phase interface and its implementations for forms and trials."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from hashlib import sha256
from typing import Any, Literal, Protocol, runtime_checkable

from starlette.datastructures import ImmutableMultiDict
from wtforms import IntegerField, RadioField, SelectMultipleField, StringField, TextAreaField
from wtforms.fields.choices import SelectChoice
from wtforms.form import BaseForm
from wtforms.meta import DefaultMeta
from wtforms.validators import InputRequired, Length, NumberRange, Optional
from wtforms.widgets import CheckboxInput, ListWidget

from experiments.visit.plan import VisitPlan
from experiments.visit.texts import Section
from experiments.visit.texts.items import MAX_LINE, MAX_TEXT, Item

Outcome = Literal["next", "no_consent", "screened_out"]
Answers = Mapping[str, Any]
FormData = ImmutableMultiDict[str, str]
"""Fields of a submitted form."""
COUNTED = "counted"  # name under which the answers of the last attempt at the comprehension check are stored


@dataclass(frozen=True)
class Visitor:
    """Information about a participant that a phase can use.

    Attributes:
        shown_s: Time since the phase was first shown, in seconds.
        attempts: Number of rejected submissions that count as attempts in this phase.
        path: URL path of the participant's pages.
        metrics: Metrics of the task in the phase `result`, otherwise None.
    """

    answers: Answers
    shown_s: float
    attempts: int
    path: str
    metrics: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Page:
    """A page to be rendered from a template with these values."""

    template: str
    values: Mapping[str, Any]


@dataclass(frozen=True)
class Done:
    """The result of accepting a form. `outcome` determines whether the visit continues or ends."""

    answers: Answers = field(default_factory=dict)
    outcome: Outcome = "next"


@dataclass(frozen=True)
class Again:
    """The result of rejecting a form. The page is shown again with `note` as the error message.

    Attributes:
        counts: True if the form counts as an attempt.
        kept: Values to save with the number of attempts if the form counts.
    """

    note: str
    values: Mapping[str, Any] = field(default_factory=dict)
    counts: bool = True
    kept: Answers = field(default_factory=dict)


@runtime_checkable
class Phase(Protocol):
    """The interface of a phase, such as a form or a trial."""

    name: str

    def page(self, visitor: Visitor, refused: Again | None = None) -> Page:
        """Return the page to show. `refused` is given if the participant's last form was rejected."""
        ...

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
        """Validate a submitted form. Return its values, or the reason why the form is refused."""


class FormPhase:
    """A phase that shows a text and a form. Both come from the section `name` of the texts."""

    def __init__(self, plan: VisitPlan, name: str, template: str = "form") -> None:
        self.name, self._template = name, template
        self._plan = plan
        self.texts: Section = plan.texts[name]

    @property
    def items(self) -> Sequence[Item]:
        """Questions of the form."""
        return self.texts.items

    def page(self, visitor: Visitor, refused: Again | None = None) -> Page:
        """Return the page with the form. It contains the values of a refused form, a draft or an earlier answer."""
        form = refused.values.get("form") if refused else None
        return Page(
            self._template,
            {
                "section": self.texts,
                "form": form or self._form(None, visitor.answers),
                "note": refused.note if refused else "",
                "saves": bool(self.items),
                **self.values(visitor),
            },
        )

    def values(self, visitor: Visitor) -> Mapping[str, Any]:  # noqa: ARG002 - used by subclasses
        """Return additional values for the page's template."""
        return {}

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
        """Validate a submitted form. Return its values, or the reason why the form is refused."""
        form = self._form(sent, visitor.answers)
        if not form.validate():
            return Again(self._plan.texts["common"]["faults"], {"form": form})
        return Done(
            {
                item.name: form[item.name].data
                for item in self.items
                if form[item.name].data not in (None, "", [])
            }
        )

    def example(self) -> dict[str, str]:
        """Return example form data that answers all required questions."""
        return {item.name: item.example() for item in self.items if item.required}

    def drafts(self, sent: FormData) -> Answers:
        """Return the valid answers from a form that the participant is still filling in."""
        form = self._form(sent, {})
        form.validate()
        given = {item.name: form[item.name] for item in self.items if item.name in sent}
        return {
            name: field.data for name, field in given.items() if not field.errors and field.data is not None
        }

    def _form(self, sent: FormData | None, answers: Answers) -> Any:
        form = form_of(self.items, self.texts.scale, self._plan.texts["common"], self._plan.language)
        form.process(sent, data=dict(answers))
        return form


class Story(FormPhase):
    """The page with the background story of the task."""

    def values(self, visitor: Visitor) -> Mapping[str, Any]:  # noqa: ARG002 - the same for all participants
        return {"paragraphs": self._plan.story_paragraphs}


class ResultPhase(FormPhase):
    """The result page, which shows the metrics of the task and may offer a link to play again."""

    def values(self, visitor: Visitor) -> Mapping[str, Any]:
        return {
            "metrics": visitor.metrics,
            "path": visitor.path,
            "again": bool(self._plan.recruiter.parameters),
            "decimal": self._plan.texts["hud"]["decimal"],
        }


class Consent(FormPhase):
    """The consent form, including any additional questions from the study's texts."""

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
        if sent.get("agree") == "no":
            return Done({"agreed": False}, "no_consent")
        if sent.get("agree") != "yes":
            return Again(self._plan.texts["common"]["required"])
        read = super().read(visitor, sent)
        if isinstance(read, Again):
            return read
        text = {
            "text_version": self._plan.consent_version,
            "text_sha256": sha256(self.copy.encode()).hexdigest(),
        }
        return Done({"agreed": True, **text, **read.answers})

    @property
    def copy(self) -> str:
        """Text that the participant agrees to. Its hash is stored with the agreement."""
        return "\n\n".join((self.texts["title"], *self.texts.paragraphs(), self.texts["agree"])) + "\n"

    def example(self) -> dict[str, str]:
        return {"agree": "yes", **super().example()}


class Comprehension(FormPhase):
    """The comprehension check. A participant who fails too many attempts is screened out.

    Only complete forms count as attempts. Each page contains the number of the attempt, so that a form that is
    submitted twice counts once. Other answers on an old page count as an attempt.
    """

    def values(self, visitor: Visitor) -> Mapping[str, Any]:
        limit = self._plan.limits.attempts
        left = (
            "" if limit is None else self.texts["attempts"].replace("{left}", str(limit - visitor.attempts))
        )
        return {"story": self._plan.story_paragraphs, "attempt": visitor.attempts, "attempts_left": left}

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
        read = super().read(visitor, sent)
        if isinstance(read, Again):
            return dataclasses.replace(read, counts=False)
        if not any(item.is_wrong(read.answers.get(item.name)) for item in self.items):
            return read
        shown = {"form": self._form(None, read.answers)}
        again = Again(self.texts["wrong"], shown, kept={COUNTED: read.answers})
        is_old = sent.get("attempt", str(visitor.attempts)) != str(visitor.attempts)
        if is_old and visitor.answers.get(COUNTED, read.answers) == read.answers:
            return dataclasses.replace(again, counts=False)
        limit = self._plan.limits.attempts
        last = limit is not None and visitor.attempts + 1 >= limit
        return Done(read.answers, "screened_out") if last else again


class Survey(FormPhase):
    """The survey. A participant who fails too many attention checks is screened out."""

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
        read = super().read(visitor, sent)
        allowed = self._plan.limits.inattentive
        if isinstance(read, Again) or allowed is None:
            return read
        wrong = sum(item.is_wrong(read.answers.get(item.name)) for item in self.items)
        return dataclasses.replace(read, outcome="screened_out") if wrong > allowed else read


def form_of(items: Sequence[Item], scale: Sequence[str], common: Section, language: str = "en") -> BaseForm:
    """Create a form with one field per item. `scale` contains the labels for the points of rating scales."""
    meta = DefaultMeta()
    meta.locales = [language]  # language of the validation messages from WTForms
    return BaseForm({item.name: _field(item, scale, common) for item in items}, meta=meta)


def _field(item: Item, scale: Sequence[str], common: Section) -> Any:
    needed: list[Any] = [InputRequired(common["required"]) if item.required else Optional()]
    label = item.text if item.required else f"{item.text} {common['optional']}"
    match item.kind:
        case "scale":
            points = [SelectChoice(str(point), word) for point, word in enumerate(scale, 1)]
            return RadioField(label, needed, choices=points, coerce=int, validate_choice=item.required)
        case "choice":
            choices = [SelectChoice(choice) for choice in item.choices]
            return RadioField(label, needed, choices=choices, validate_choice=item.required)
        case "several":
            widget = {"widget": ListWidget(prefix_label=False), "option_widget": CheckboxInput()}
            return SelectMultipleField(
                label, needed, choices=[SelectChoice(c) for c in item.choices], **widget
            )
        case "number":
            return IntegerField(label, [*needed, NumberRange(item.low, item.high)])
        case "line":
            return StringField(label, [*needed, Length(max=MAX_LINE)])
        case "text":
            return TextAreaField(label, [*needed, Length(max=MAX_TEXT)])


class TrialPhase:
    """A phase in which the participant completes a trial. It has no form."""

    def __init__(self, plan: VisitPlan, name: str) -> None:
        self.name = name
        self._plan = plan

    def page(self, visitor: Visitor, refused: Again | None = None) -> Page:  # noqa: ARG002 - there is no form
        return Page("play", {"trial": self.name})

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:  # noqa: ARG002 - there is no form
        return Again(self._plan.texts["common"]["too_early"])
