"""The study plan of `mjsim play`, which is a minimal study with an open link and no payments."""

import argparse
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
from msgspec.structs import replace

from experiments.record.phases import STORY, TRAINING
from experiments.session.familiarise import story_text, with_names
from experiments.trials.training import trials_of
from experiments.trials.trial_config import MAX_SEED, TrialConfig
from experiments.visit.plan import COMPREHENSION, RESULT, Limits, VisitPlan
from experiments.visit.recruiter import OpenLink
from experiments.visit.store import Assignment, CellQuota
from experiments.visit.texts import Section, read_texts, story_file
from experiments.visit.texts.items import Item
from experiments.web.worker.encoders import poster
from mjsim.formats.gltf.cache import view_path
from mjsim.formats.gltf.store import scenes_folder
from mjsim.generator.home_cache import load_catalogue

NAME = "play"  # name under which `mjsim play` stores its study in the database
MINUTES = 15
DAY_S = 86400.0
MAX_VISITS = 1_000_000
PLACEHOLDERS = ("title", "institution", "contact", "minutes")  # names of placeholders in study texts
_NOTHING = Section({})


def _texts(language: str, questions: tuple[Item, ...]) -> dict[str, Section]:
    empty = dict.fromkeys(PLACEHOLDERS, "")
    words = read_texts(language, None, empty)["play"].words
    texts = dict(read_texts(language, None, {**empty, "contact": words["contact"]}))
    for name, text in texts["play"].words.items():
        section, _, word = name.partition("_")
        if word in texts.get(section, _NOTHING).words:
            texts[section] = replace(texts[section], words={**texts[section].words, word: text})
    texts[COMPREHENSION] = replace(texts[COMPREHENSION], items=questions)
    return texts


def _story(arguments: argparse.Namespace, words: Section, task: TrialConfig, phases: Sequence[str]) -> str:
    if STORY not in phases:
        return ""
    assistance = str(task.assistance).split("-")[0]
    path = arguments.story or story_file(arguments.language)
    shown = {
        "story_list": True,
        "story_poles": assistance in ("highlight", "optimal", "guided"),
        "story_plan": assistance in ("optimal", "guided"),
        "story_training": TRAINING in phases,
    }
    more = [words[name] for name, is_shown in shown.items() if is_shown]
    catalogue = load_catalogue(task.house).in_language(arguments.language)
    return "\n\n".join([with_names(story_text(None if path is None else Path(path)), catalogue), *more])


def plan_of_play(
    arguments: argparse.Namespace, task: TrialConfig, phases: Sequence[str], questions: tuple[Item, ...]
) -> VisitPlan:
    shown = [*phases, RESULT]
    if questions:
        shown.insert(shown.index(STORY) + 1, COMPREHENSION)
    texts = _texts(arguments.language, questions)
    # A fixed episode is played only once, because the result page reveals its shortest path.
    again = task.episode is None

    def trials(place: Assignment) -> Mapping[str, dict[str, Any]]:
        """Return the settings of a participant's trials.

        Each participant has a different order seed and therefore sees the task list in a different order.
        """
        order, house = task.order_seed + place.person_id - 1, place.house_seed
        seeds = {"order_seed": order % (MAX_SEED + 1), "house_seed": house % (MAX_SEED + 1)}
        return trials_of(msgspec.structs.replace(task, **seeds))

    return VisitPlan(
        name=NAME,
        title=texts["welcome"]["title"],
        language=arguments.language,
        phases=tuple(shown),
        texts=texts,
        story=_story(arguments, texts["play"], task, shown),
        minimum=arguments.minimum,
        limits=Limits(
            idle=max(arguments.idle, 1.0),
            abandoned_after=DAY_S,
            timed_out_after=math.inf,
            attempts=None,
        ),
        minutes=MINUTES,
        cells=[CellQuota(MAX_VISITS, [task.house_seed])],
        assignment="uniform",
        trials=trials,
        recruiter=OpenLink(repeats=again),
        film=arguments.film,
        poster=poster(arguments.film) if arguments.film else "",
        picture=view_path(load_catalogue(task.house), scenes_folder()),
        headset=arguments.xr,
        floor_plan=True,
    )
