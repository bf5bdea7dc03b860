"""Read study files. A study file is a batch design with an additional `[study]` table."""

import hashlib
import itertools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec

from experiments.errors import ConfigError
from experiments.record.phases import FLYTHROUGH, HUMAN, STORY, TASK, TRAINING
from experiments.session.familiarise import story_text
from experiments.trials.design import counted, read_design
from experiments.trials.exclusions import Exclusions
from experiments.trials.toml_file import TomlFile
from experiments.trials.trial_config import TrialConfig
from experiments.visit.plan import COMPLETION, COMPREHENSION, CONSENT, PHASES, PLAYED, VisitSettings
from experiments.visit.texts import Texts, read_texts, story_file
from mjsim.support.files import read_bytes
from mjsim.support.urls import parse_url

TEMPLATE = Path(__file__).with_name("template.toml")

Money = Annotated[float, msgspec.Meta(ge=0.0, le=10_000.0)]
Code = Annotated[str, msgspec.Meta(pattern=r"^[0-9A-Za-z_-]{0,64}\Z")]
# The origin of a web page, which consists of the scheme, the host and an optional port
Site = Annotated[str, msgspec.Meta(pattern=r"^https?://[0-9A-Za-z.-]+(:[0-9]{1,5})?\Z")]

MAX_MINIMUM_S = 86400
# Placeholders in a story that depend on the house
BINS = re.compile(r"\{(bins|categories|count)\}", re.IGNORECASE)
HERE = ("localhost", "127.0.0.1", "::1")  # hosts that may be contacted without TLS


class _Table(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    pass


class Pay(_Table, frozen=True):
    """The payments to participants, in units of `currency`."""

    currency: Annotated[str, msgspec.Meta(pattern=r"^[A-Z]{3}\Z")] = "USD"
    reward: Money = 0.0  # pay for completing the study
    screen_out: Money = 0.0  # pay for screened-out participants
    bonus_for_all: Money = 0.0  # bonus for putting all objects away
    fee: Annotated[float, msgspec.Meta(ge=0.0, le=10.0)] | None = None  # platform fee as a share of the pay
    wage: Money = 0.0  # hourly wage below which `mjsim study check` reports a problem
    partial: bool = False  # if True, participants who leave during or after the task get part of the reward

    def __post_init__(self) -> None:
        for name in ("reward", "screen_out", "bonus_for_all"):
            if (value := getattr(self, name)) != round(value, 2):
                raise ValueError(f"{name} is {value}; amounts have at most two decimals")


class Recruitment(_Table, frozen=True):
    """Settings of the recruitment platform, such as the codes and ids in its links."""

    platform: Literal["link", "lab", "prolific", "connect", "external-question"] = "link"
    completed: Code = ""  # completion code that participants enter on the platform
    screened_out: Code = ""
    no_consent: Code = ""
    study_id: Code = ""  # id of the study on the platform; links with other ids are refused
    sites: tuple[Site, ...] = ()  # origins of platform pages that embed the study
    api_url: str = ""  # URL of the platform's API, or empty for the default

    def __post_init__(self) -> None:
        if not self.api_url:
            return
        try:
            url = parse_url(self.api_url)
        except ValueError:
            raise ValueError(
                f"api_url is {self.api_url!r}; write it as https://HOST or https://HOST/PATH"
            ) from None
        if url.scheme == "http" and url.hostname not in HERE:
            raise ValueError(f"api_url is {self.api_url!r}; it gets a secret, so it must begin with https://")


class StudySettings(VisitSettings, frozen=True, kw_only=True):
    """The contents of the `[study]` table in a study file."""

    institution: str
    contact: str
    texts: str | None = None
    pay: Pay = Pay()
    recruitment: Recruitment = Recruitment()

    def __post_init__(self) -> None:
        usual = [name for name in self.phases if name in PHASES]
        if usual != [name for name in PHASES if name in usual] or len(set(self.phases)) < len(self.phases):
            raise ValueError(
                f"phases are {', '.join(self.phases)}; each at most once, in the order {', '.join(PHASES)}"
            )
        for name in (TASK, COMPLETION):
            if name not in self.phases:
                raise ValueError(f"a study needs the phase {name}; add it to phases")
        if unknown := [name for name in self.phases if name not in PHASES and ":" not in name]:
            raise ValueError(
                f"no phase {unknown[0]!r}; there are {', '.join(PHASES)}, or package.module:attribute"
            )
        if unknown := [name for name in (*self.minimum, *self.optional) if name not in self.phases]:
            raise ValueError(f"minimum or optional names {unknown[0]!r}, which is not among the phases")
        if ended := [name for name in self.minimum if name in (*PLAYED, COMPLETION)]:
            raise ValueError(f"minimum names {ended[0]!r}, which no time ends; leave it out")
        if played := [name for name in self.optional if name in (CONSENT, TASK, COMPLETION)]:
            raise ValueError(f"optional names {played[0]!r}, which cannot be skipped; leave it out")
        for name, seconds in self.minimum.items():
            if not (isinstance(seconds, int | float) and 0.0 <= seconds <= MAX_MINIMUM_S):
                raise ValueError(f"minimum.{name} is {seconds!r}; expected 0 to {MAX_MINIMUM_S} seconds")


@dataclass(frozen=True)
class Cell:
    """A cell of the study design, with one trial for each participant that it needs.

    The trials take place in the houses of the design in turn, so participants of a cell spread over them evenly.
    """

    trials: Sequence[TrialConfig]

    @property
    def label(self) -> str:
        return f"{self.trials[0].assistance}, {counted(self.trials[0].objects, 'object')}"

    def trial(self, place: int) -> TrialConfig:
        """Return the trial at an index. Indices beyond the last trial wrap around to the first trial."""
        return self.trials[place % len(self.trials)]


@dataclass(frozen=True)
class Study:
    """A validated study file with the texts that are shown to participants."""

    path: Path
    sha256: str  # SHA-256 of the study file
    settings: StudySettings
    cells: Sequence[Cell]
    texts: Texts
    story: str  # text with placeholders for the bins of the house
    exclusions: Exclusions | None
    rehearsal: bool = False  # True if all participants are simulated

    @property
    def people(self) -> int:
        return sum(len(cell.trials) for cell in self.cells)


def read_people_study(path: Path) -> Study:
    """Read and validate a study file.

    Raises:
        ConfigError: The file is missing or invalid. The message names the file, the line and the value.
    """
    of_cells: list[Sequence[TrialConfig]] = []  # trials of each `[[cells]]` table
    design, file = read_design(path, of_cells.append), TomlFile.read(path, "study")
    table = file.content.get("study")
    if table is None:
        raise ConfigError(
            f"{path} has no table [study], which a study with people needs; `mjsim study init` writes one"
        )
    homes = len({trial.house for trial in design.trials})
    try:
        settings = msgspec.convert(_finite(table), StudySettings)
        if homes > 1:
            settings = _without_film(settings, table.get("phases", ()), homes)
        own_texts = path.parent / settings.texts if settings.texts else None
        texts = read_texts(settings.language, own_texts, _values(settings))
        own = design.trials[0].story
        is_shown = homes > 1 or not {STORY, COMPREHENSION}.isdisjoint(settings.phases)
        usual = None if own or not is_shown else story_file(settings.language, several_homes=homes > 1)
    except (msgspec.ValidationError, ConfigError) as error:
        raise file.fault(error, "study", _StudyFile) from error
    if any(trial.trial_number > 1 for trial in design.trials):
        raise ConfigError(
            f"{path}: trials_per_person is for simulated people; a visit of a person has one task"
        )
    _check_cells(path, of_cells)
    cells = [Cell([_of_a_person(trial, settings.phases, usual) for trial in trials]) for trials in of_cells]
    story = story_text(usual if own is None else Path(own))
    if homes > 1 and (named := BINS.search(story)):
        told = (
            f"story has {named[0]}, but the bins differ between the {homes} houses; use other words in {own}"
        )
        raise file.fault(ConfigError(told), "cells[0]")
    return Study(
        path,
        hashlib.sha256(read_bytes(path)).hexdigest(),
        settings,
        cells,
        texts,
        story,
        design.exclusions,
    )


class _StudyFile(msgspec.Struct):
    study: StudySettings


def _finite(table: dict[str, Any], name: str = "") -> dict[str, Any]:
    """Return a table, or raise `ConfigError` if it contains a number that is infinite or not a number."""
    for key, value in table.items():
        if isinstance(value, dict):
            _finite(value, f"{name}{key}.")
        elif isinstance(value, float) and not math.isfinite(value):
            raise ConfigError(f"{name}{key} is {value}; expected a finite number")
    return table


def _without_film(settings: StudySettings, named: Sequence[str], homes: int) -> StudySettings:
    """Leave out the film of a study in several houses. Raise `ConfigError` if the study file asks for the film."""
    if FLYTHROUGH in named or settings.require_film:
        told = "phases has flythrough" if FLYTHROUGH in named else "require_film is true"
        raise ConfigError(f"{told}, but a film shows one house and the cells have {homes}; leave it out")
    return msgspec.structs.replace(
        settings,
        phases=tuple(name for name in settings.phases if name != FLYTHROUGH),
        minimum={name: seconds for name, seconds in settings.minimum.items() if name != FLYTHROUGH},
        optional=tuple(name for name in settings.optional if name != FLYTHROUGH),
    )


def _of_a_person(trial: TrialConfig, phases: Sequence[str], story: Path | None) -> TrialConfig:
    before = [name for name in (STORY, FLYTHROUGH, TRAINING) if name in phases]
    settings: dict[str, Any] = {**trial.settings(), "user": HUMAN, "live": True, "behaviour": {}}
    if STORY not in phases:  # the comprehension check may still show the story
        settings["story"] = None
    elif story is not None and trial.story is None:
        settings["story"] = str(story)
    return TrialConfig.of({**settings, "phases": ",".join([*before, TASK])})


def _check_cells(path: Path, of_cells: Sequence[Sequence[TrialConfig]]) -> None:
    """Raise `ConfigError` if a setting that does not belong to a condition differs between cells."""
    for name in ("story", "training_assistance"):
        if len(values := {getattr(trials[0], name) for trials in of_cells}) > 1:
            raise ConfigError(
                f"{path}: cells differ in {name} ({', '.join(map(str, values))}); it is one for all"
            )
    for trials in itertools.zip_longest(*of_cells):
        if len(houses := {trial.house for trial in trials if trial is not None}) > 1:
            told = (
                f"cells differ in houses ({', '.join(sorted(houses))}); name the same ones in the same order"
            )
            raise ConfigError(f"{path}: {told}")


def _values(settings: StudySettings) -> Mapping[str, str]:
    pay = settings.pay
    amounts = {"pay": pay.reward, "screen_out": pay.screen_out}
    paid = {name: f"{Decimal(str(n)):.2f} {pay.currency}" for name, n in amounts.items() if n}
    days = settings.limits.keep_days
    kept = {} if days is None else {"keep_days": str(days)}
    return {
        "title": settings.title,
        "institution": settings.institution,
        "contact": settings.contact,
        "minutes": str(settings.minutes),
        **paid,
        **kept,
        **({"partial": "yes"} if pay.partial else {}),
    }
