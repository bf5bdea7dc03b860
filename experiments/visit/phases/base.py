"""The interface of phases, and the phases that consist of a text and a form."""

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
    """Data of the participant that a phase may use.

    Attributes:
        answers: Answers given in this phase so far.
        shown_s: Time since the phase was first shown, in seconds.
        attempts: Number of rejected forms in this phase.
        path: Path of the participant's pages.
        metrics: Metrics of the task, only in the phase `result`.
    """

    answers: Answers
    shown_s: float
    attempts: int
    path: str
    metrics: Mapping[str, Any] | None = None


@dataclass(frozen=True)
class Page:
    """A template by name, and its values."""

    template: str
    values: Mapping[str, Any]


@dataclass(frozen=True)
class Done:
    """An accepted form: the answers and what follows."""

    answers: Answers = field(default_factory=dict)
    outcome: Outcome = "next"


@dataclass(frozen=True)
class Again:
    """A rejected form: the phase is shown again with a note."""

    note: str
    values: Mapping[str, Any] = field(default_factory=dict)


@runtime_checkable
class Phase(Protocol):
    """A phase of a visit."""

    name: str

    def page(self, visitor: Visitor, refused: Again | None = None) -> Page:
        """Return the page. `refused` is the result of a rejected form."""
        ...

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again: ...


class FormPhase:
    """A page with a text, the items of a form and a button.

    Args:
        plan: Plan of the visit.
        name: Name of the phase and of its section in the texts.
        template: Template of its page.
    """

    def __init__(self, plan: VisitPlan, name: str, template: str = "form") -> None:
        self.name, self._template = name, template
        self._plan = plan
        self.texts: Section = plan.texts[name]

    @property
    def items(self) -> Sequence[Item]:
        return self.texts.items

    def page(self, visitor: Visitor, refused: Again | None = None) -> Page:
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
        """Return a form that is accepted, with answers to all required items."""
        return {item.name: item.example() for item in self.items if item.required}

    def drafts(self, sent: FormData) -> Answers:
        """Return the valid answers of a form that has not been submitted yet."""
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
    """The story."""

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
    """The consent form, and further items if the study's texts have any."""

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
        if sent.get("agree") == "no":
            return Done({"agreed": False}, "no_consent")
        if sent.get("agree") != "yes":
            return Again(self._plan.texts["common"]["required"])
        read = super().read(visitor, sent)
        return Done({"agreed": True, **read.answers}) if isinstance(read, Done) else read

    def example(self) -> dict[str, str]:
        return {"agree": "yes", **super().example()}


class Comprehension(FormPhase):
    """Questions about the task. Too many failed attempts screen the participant out."""

    def values(self, visitor: Visitor) -> Mapping[str, Any]:  # noqa: ARG002 - the same for all
        return {"story": self._plan.story_paragraphs}

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
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
    """The survey. Too many wrong answers to attention checks screen the participant out."""

    def read(self, visitor: Visitor, sent: FormData) -> Done | Again:
        read = super().read(visitor, sent)
        allowed = self._plan.limits.inattentive
        if isinstance(read, Again) or allowed is None:
            return read
        wrong = sum(item.is_wrong(read.answers.get(item.name)) for item in self.items)
        return dataclasses.replace(read, outcome="screened_out") if wrong > allowed else read
