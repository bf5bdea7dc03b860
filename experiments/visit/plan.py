"""Visit plans, which list the phases through which a server leads its participants."""

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
    width: Annotated[int, msgspec.Meta(ge=0)] = 800  # minimum width of the window, in pixels
    height: Annotated[int, msgspec.Meta(ge=0)] = 500
    keyboard: bool = True


class Limits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Timeouts of participants, and limits on failed checks."""

    idle: Seconds = 1800.0  # inactivity after which a trial's slot is released, in seconds
    abandoned_after: Seconds = 1800.0  # inactivity after which a place in a cell is released, in seconds
    timed_out_after: Seconds = 14400.0  # inactivity after which a participant is timed out, in seconds
    attempts: Count = 3  # number of attempts allowed at the comprehension check
    # number of wrong answers allowed in the survey's attention checks; if None, they do not screen out anyone
    inattentive: Annotated[int, msgspec.Meta(ge=0, le=1000)] | None = None
    keep_days: Count | None = None  # days from the last activity to the deletion of identifying data

    def __post_init__(self) -> None:
        if self.timed_out_after < self.abandoned_after:
            raise ValueError(
                f"timed_out_after is {self.timed_out_after:g} s; it cannot be less than abandoned_after, "
                f"{self.abandoned_after:g} s"
            )


@dataclass(frozen=True)
class VisitPlan:
    """A plan for all visits to a study or to `mjsim play`.

    Attributes:
        name: Name of the study in the database.
        language: Language tag of the pages.
        phases: Names of the phases, in order. A visit is finished once it reaches the last one.
        story: Text of the story, with blank lines between paragraphs.
        minimum: Minimum duration of each phase, in seconds. It is infinite for trials that cannot be ended early.
        optional: Names of the phases that participants may skip.
        minutes: Expected duration of a visit, in minutes.
        cells: Cells of the design. Each participant is assigned a place in one of them.
        trials: Function that returns the settings of an assignment's trials, by phase.
        headset: True if trials can be played with a VR headset.
        floor_plan: True if a floor plan with the paths walked is added to the run of the task.
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
