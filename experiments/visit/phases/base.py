"""Phases of a visit: the interface, and phases that are a text with a form."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, Protocol, runtime_checkable

from starlette.datastructures import ImmutableMultiDict

from experiments.visit.phases.forms import form_of
from experiments.visit.plan import VisitPlan
from experiments.visit.texts import Section
from experiments.visit.texts.items import Item

Outcome = Literal["next", "no_consent", "screened_out"]
Answers = Mapping[str, Any]
FormData = ImmutableMultiDict[str, str]
"""Fields of a submitted form."""


@dataclass(frozen=True)
class Visitor:
    """What a phase may know of the person in it.

    Attributes:
        answers: Given in this phase so far.
        shown_s: How long ago the phase was shown first, s.
        attempts: How many answers of it were refused.
        path: Of the person's pages.
        metrics: Metrics of the task, in the phase `result`.
    """

    answers: Answers
    shown_s: float
    attempts: int
    path: str
    metrics: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Page:
    """A page: a template by name, and its values."""

    template: str
    values: Mapping[str, Any]


@dataclass(frozen=True)
class Done:
    """The phase is over: what was answered, and what follows."""

    answers: Answers = field(default_factory=dict)
    outcome: Outcome = "next"


@dataclass(frozen=True)
class Again:
    """The phase is shown again with a note."""

    note: str
    values: Mapping[str, Any] = field(default_factory=dict)


@runtime_checkable
class Phase(Protocol):
    """A phase of a visit."""

    name: str

    def page(self, visitor: Visitor, refused: Again | None = None) -> Page:
        """What the person sees; `refused` is what was wrong with what was sent."""
        ...

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again: ...


class FormPhase:
    """A text, the items of a form, and a button.

    Args:
        plan: Plan of the visit.
        name: Of the phase, and of the section of its texts.
        template: Of its page.
    """

    def __init__(self, plan: VisitPlan, name: str, template: str = "form") -> None:
        self.name, self._template = name, template
        self._plan = plan
        self.texts: Section = plan.texts[name]

    @property
    def items(self) -> Sequence[Item]:
        return self.texts.items

    def page(self, visitor: Visitor, refused: Again | None = None) -> Page:
        """The text and the form, with the answers so far."""
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

    def values(self, visitor: Visitor) -> Mapping[str, Any]:  # noqa: ARG002 - of subclasses
        return {}

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
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
        """A form that is accepted, as `mjsim study check` sends it; items that need no answer get none."""
        return {item.name: item.example() for item in self.items if item.required}

    def drafts(self, sent: FormData) -> Answers:
        """The answers among what is in a form that is not sent yet; those that cannot be used are left out."""
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
    """The story as a text."""

    def values(self, visitor: Visitor) -> Mapping[str, Any]:  # noqa: ARG002 - the same for all
        return {"paragraphs": self._plan.story_paragraphs}


class Result(FormPhase):
    """Metrics of the task, and a link to play again unless the plan has only one episode."""

    def values(self, visitor: Visitor) -> Mapping[str, Any]:
        return {
            "metrics": visitor.metrics,
            "path": visitor.path,
            "again": bool(self._plan.recruiter.parameters),
            "decimal": self._plan.texts["hud"]["decimal"],
        }


class Consent(FormPhase):
    """A statement to agree with, or not."""

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
        """Whether the person agrees; items of a study's own texts have to be answered besides."""
        if sent.get("agree") == "no":
            return Done({"agreed": False}, "no_consent")
        if sent.get("agree") != "yes":
            return Again(self._plan.texts["common"]["required"])
        read = super().read(visitor, sent)
        return Done({"agreed": True, **read.answers}) if isinstance(read, Done) else read

    def example(self) -> dict[str, str]:
        return {"agree": "yes", **super().example()}


class Comprehension(FormPhase):
    """Questions about the story, which can be read again on the same page."""

    def values(self, visitor: Visitor) -> Mapping[str, Any]:  # noqa: ARG002 - the same for all
        return {"story": self._plan.story_paragraphs}

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
        """The answers, if all are right; after the last attempt the person is screened out."""
        read = super().read(visitor, sent)
        if isinstance(read, Again):
            return read
        wrong = any(item.is_wrong(read.answers.get(item.name)) for item in self.items)
        answers = dict(read.answers)
        if not wrong:
            return Done(answers)
        if visitor.attempts + 1 >= self._plan.limits.attempts:
            return Done(answers, "screened_out")
        return Again(self.texts["wrong"], {"form": self._form(None, read.answers)})


class Survey(FormPhase):
    """Items; those with a right answer show whether they were read."""

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
        """The answers; whoever gives too many wrong ones is screened out where the study file says so."""
        read = super().read(visitor, sent)
        allowed = self._plan.limits.inattentive
        if isinstance(read, Again) or allowed is None:
            return read
        wrong = sum(item.is_wrong(read.answers.get(item.name)) for item in self.items)
        return dataclasses.replace(read, outcome="screened_out") if wrong > allowed else read
