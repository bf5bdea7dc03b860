"""Visit plans, which define the phases of a study and the settings that all participants share."""

from collections.abc import Callable, Mapping, Sequence
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
    """The requirements that a participant's computer must meet."""

    frames_per_s: Annotated[float, msgspec.Meta(ge=0.0, le=240.0)] = 20.0
    latency_ms: Annotated[float, msgspec.Meta(ge=1.0)] = 500.0
    width: Annotated[int, msgspec.Meta(ge=0)] = 800  # minimum width of the window, in pixels
    height: Annotated[int, msgspec.Meta(ge=0)] = 500
    keyboard: bool = True


class Limits(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Timeouts for inactive participants, and limits on failed checks."""

    idle: Seconds = 1800.0  # period of inactivity after which a trial's slot is released, in seconds
    abandoned_after: Seconds = 1800.0  # period of inactivity after which a place is released, in seconds
    timed_out_after: Seconds = 14400.0  # period of inactivity after which a participant times out, in seconds
    attempts: Count | None = 3  # maximum number of attempts at the comprehension check, or None for no limit
    # Number of attention checks in the survey that a participant may fail, or None for no limit
    inattentive: Annotated[int, msgspec.Meta(ge=0, le=1000)] | None = None
    keep_days: Count | None = None  # days of inactivity after which identifying data are deleted

    def __post_init__(self) -> None:
        if self.timed_out_after < self.abandoned_after:
            raise ValueError(
                f"timed_out_after is {self.timed_out_after:g} s; it cannot be less than abandoned_after, "
                f"{self.abandoned_after:g} s"
            )


class VisitSettings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The settings of a visit that a study file contains."""

    # Name of the study in the database
    name: Annotated[str, msgspec.Meta(pattern=r"^[a-z0-9][a-z0-9-]{0,39}\Z")]
    title: Annotated[str, msgspec.Meta(pattern=r"\S")]
    minutes: Count = 25  # expected duration of a visit
    language: Annotated[str, msgspec.Meta(pattern=r"^[a-zA-Z]{2,3}(-[a-zA-Z0-9]{2,8})*\Z")] = "en"
    consent_version: str = "1"  # version of the consent text, which is stored with each agreement
    phases: tuple[str, ...] = PHASES  # a visit is finished when the participant reaches the last phase
    require_film: bool = False  # if True, participants must play the film to its end
    explain_markers: bool = False  # if True, the instructions show a picture of the condition's markers
    assignment: Rule = "balanced"
    # Minimum duration of phases in seconds. In a `VisitPlan`, it is infinite for trials that cannot be ended early.
    minimum: dict[str, Any] = {}
    optional: tuple[str, ...] = ()  # phases that participants may skip
    device: Device = Device()
    limits: Limits = Limits()


class VisitPlan(VisitSettings, frozen=True, kw_only=True):
    """A plan with the phases and settings of a study or of `mjsim play`.

    Attributes:
        story: Text of the story, with blank lines between paragraphs.
        cells: Cells of the design. Each participant is assigned a place in one of them.
        trials: Function that returns the settings of the trials for an assignment, by phase.
        poster: Data URL of the picture that the page of the film shows before the film is played, or an empty text.
        picture: File of the picture on the welcome page, or None. Workers may still be drawing it. The file is empty
            if the picture cannot be drawn.
        headset: True if trials can be played with a VR headset.
        floor_plan: True if the run directory of the task includes a floor plan with the participant's path.
        rehearsal: True if all participants are simulated.
    """

    texts: Texts
    story: str
    cells: Sequence[CellQuota]
    trials: Callable[[Assignment], Mapping[str, dict[str, Any]]]
    recruiter: Recruiter
    film: Path | None = None
    poster: str = ""
    picture: Path | None = None
    headset: bool = False
    floor_plan: bool = False
    rehearsal: bool = False

    @property
    def has_picture(self) -> bool:
        """True if the welcome page has a picture, including one that is still being drawn."""
        return self.picture is not None and (not self.picture.is_file() or self.picture.stat().st_size > 0)

    @property
    def scene(self) -> str:
        """URL path of the house's scene files, which are in the same folder as the picture, or an empty text."""
        return f"/scene/{self.picture.parent.name}/" if self.picture else ""

    @property
    def story_paragraphs(self) -> list[str]:
        """The paragraphs of the story."""
        return [part for part in self.story.split("\n\n") if part.strip()]
