"""The plan of a visit, which a server follows to take participants through all phases."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec

from experiments.record.phases import FLYTHROUGH, STORY, TASK, TRAINING
from experiments.visit.recruiter import Recruiter
from experiments.visit.store import Assignment, CellQuota, Rule
from experiments.visit.texts import Texts

CONSENT, DEVICE, COMPREHENSION, SURVEY = "consent", "device", "comprehension", "survey"
DEBRIEFING, COMPLETION, RESULT = "debriefing", "completion", "result"
PHASES = (CONSENT, DEVICE, STORY, FLYTHROUGH, COMPREHENSION, TRAINING, TASK, SURVEY, DEBRIEFING, COMPLETION)
PLAYED = (TRAINING, TASK)

Seconds = Annotated[float, msgspec.Meta(ge=0.0, le=86400.0)]
Count = Annotated[int, msgspec.Meta(ge=1, le=1_000_000)]


class Device(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Requirements for a participant's computer."""

    frames_per_s: Annotated[float, msgspec.Meta(ge=0.0, le=240.0)] = 20.0
    latency_ms: Annotated[float, msgspec.Meta(ge=1.0)] = 500.0
    width: Annotated[int, msgspec.Meta(ge=0)] = 800  # smallest window, in pixels
    height: Annotated[int, msgspec.Meta(ge=0)] = 500
    keyboard: bool = True


class Limits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Timeouts and numbers of attempts."""

    idle: Seconds = 1800.0  # inactivity after which a trial releases its slot, in seconds
    abandoned_after: Seconds = 1800.0  # inactivity after which the place in a cell is released, in seconds
    timed_out_after: Seconds = 14400.0  # inactivity after which the participation ends, in seconds
    attempts: Count = 3  # number of attempts allowed at the comprehension check
    # number of wrong answers allowed in the survey's attention checks; None disables screening by them
    inattentive: Annotated[int, msgspec.Meta(ge=0, le=1000)] | None = None
    keep_days: Count | None = None  # days from the last activity until identifying data are deleted

    def __post_init__(self) -> None:
        if self.timed_out_after < self.abandoned_after:
            raise ValueError(
                f"timed_out_after is {self.timed_out_after:g} s; it cannot be less than abandoned_after, "
                f"{self.abandoned_after:g} s"
            )


@dataclass(frozen=True)
class VisitPlan:
    """Plan of all visits of a study, or of `mjsim play`.

    Attributes:
        name: Name of the study in the database.
        language: Language tag of the pages.
        phases: Names of the phases, in order. A visit is finished when it reaches the last one.
        story: Text of the story, with blank lines between paragraphs.
        minimum: Minimum duration by phase, in seconds. Infinite for a trial that the participant cannot end early.
        optional: Phases that may be skipped.
        minutes: Expected duration of a visit.
        cells: Cells of the design. Each participant is assigned a place in one of them.
        trials: Returns the settings of the trials of an assignment, by phase.
        headset: True if trials can be played with a VR headset.
        floor_plan: True if the run of the task gets a floor plan with the paths walked.
        rehearsal: True if all participants are simulated.
    """

    name: str
    title: str
    language: str
    phases: tuple[str, ...]
    texts: Texts
    story: str
    minimum: Mapping[str, float]
    optional: frozenset[str]
    limits: Limits
    device: Device
    minutes: float
    cells: Sequence[CellQuota]
    rule: Rule
    trials: Callable[[Assignment], Mapping[str, dict[str, Any]]]
    recruiter: Recruiter
    film: Path | None = None
    headset: bool = False
    floor_plan: bool = False
    rehearsal: bool = False

    @property
    def story_paragraphs(self) -> list[str]:
        return [part for part in self.story.split("\n\n") if part.strip()]
