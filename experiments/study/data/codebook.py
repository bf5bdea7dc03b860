"""The codebook of an export: the meaning of each column."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from experiments.analysis.study.measures import LIKERT_PREFIX
from experiments.study.file import Study
from experiments.trials.dictionary import trial_columns
from experiments.visit.plan import SURVEY
from experiments.visit.texts.items import Item

OWN = {
    "participant": "Number of the person, the same in all tables and in the names of runs.",
    "platform": "Where the person came from.",
    "status": "How the participation ended, or that it is under way.",
    "arrived": "When the person began, UTC.",
    "task_ended": "When the task was over, UTC.",
    "phase": "Phase of the study.",
    "order": "Which phase of the person it was, from 1.",
    "duration_s": "Time from showing the phase first to its end, s; empty where it did not end.",
    "attempts": "How many answers to the phase were refused.",
    "reason": "Why a trial or the phase ended.",
    "item": "Name of what was asked.",
    "answer": "The answer; scales are numbers from 1 on, several choices are joined by semicolons.",
    "inattentive": "How many items of the survey with a right answer were answered otherwise.",
    "text": "What the person wrote freely; a text that a spreadsheet would compute begins with an apostrophe.",
}


@dataclass(frozen=True)
class Variable:
    """A column of the codebook.

    Attributes:
        levels: Values with their meanings, for columns with few values.
    """

    name: str
    description: str
    low: float | None = None
    high: float | None = None
    levels: tuple[str, ...] = ()

    def as_json(self) -> dict[str, Any]:
        found: dict[str, Any] = {"@type": "PropertyValue", "name": self.name, "description": self.description}
        if self.low is not None:
            found["minValue"] = self.low
        if self.high is not None:
            found["maxValue"] = self.high
        if self.levels:
            found["valueReference"] = list(self.levels)
        return found


def codebook(study: Study, columns: Iterable[str]) -> list[Variable]:
    told = {name: what for names, (_, what) in trial_columns().items() for name in names.split(", ")}
    items = {f"{_prefix(item)}{item.name}": item for item in study.texts[SURVEY].items}
    return [_variable(study, name, told, items) for name in dict.fromkeys(columns)]


def _prefix(item: Item) -> str:
    return LIKERT_PREFIX if item.kind == "scale" else "answer_"


def _variable(study: Study, name: str, told: Mapping[str, str], items: Mapping[str, Item]) -> Variable:
    if item := items.get(name):
        if item.kind == "scale":
            scale = study.texts[SURVEY].scale
            levels = tuple(f"{point} = {words}" for point, words in enumerate(scale, 1))
            return Variable(name, item.text, 1, len(scale), levels)
        if item.kind == "number":
            return Variable(name, item.text, item.low, item.high)
        return Variable(name, item.text, levels=tuple(item.choices))
    if name in OWN:
        return Variable(name, OWN[name])
    if name in told:
        return Variable(name, told[name])
    first, _, rest = name.partition("_")
    if first == "phase" and rest.endswith("_s"):
        return Variable(name, f"Duration of the phase {rest.removesuffix('_s')}, s.", 0)
    if first in study.settings.phases:
        return Variable(name, f"{rest}, as given or measured in the phase {first}.")
    if first == "behaviour":
        return Variable(name, told["behaviour_..."])
    return Variable(name, f"{name.replace('_', ' ')}, as mjsim recorded it.")
