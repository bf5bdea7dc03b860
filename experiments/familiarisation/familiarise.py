"""What a simulated participant takes along from the phases before the task."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.familiarisation.camera_path import bins_seen, camera_path
from experiments.familiarisation.story import reading_time, story_text
from experiments.house import House
from experiments.runs.phases import FLYTHROUGH, STORY, TRAINING
from experiments.runs.records import PHASE_BEGUN, PHASE_ENDED, Event, EventLog
from mjsim.person_parameters import PersonParameters
from mjsim.visibility import FieldOfView


@dataclass(frozen=True)
class Familiarisation:
    """The phases before the task.

    Attributes:
        ended: What `phase_ended` says of each phase, in order.
        seen: Receptacles that the participant has seen; None if it knows them all.
    """

    ended: tuple[dict[str, Any], ...]
    seen: frozenset[str] | None

    def trained(self, events: Sequence[Event]) -> "Familiarisation":
        """With the training, whose log holds these events: the bin that was used is known from then on."""
        used = {event["receptacle"] for event in events if event["event"] == "placed"}
        end = {"phase": TRAINING, "duration_s": events[-1]["t"], "reason": events[-1]["reason"]}
        return Familiarisation((*self.ended, end), None if self.seen is None else self.seen | used)

    def log(self, log: EventLog) -> None:
        """Log it, before the clock of the task starts."""
        for end in self.ended:
            log.append(0.0, PHASE_BEGUN, phase=end["phase"])
            log.append(0.0, PHASE_ENDED, **end)


def familiarise(
    phases: Collection[str], story: str | None, house: House, person: PersonParameters
) -> Familiarisation:
    """Let a simulated participant read the story and watch the fly-through, as far as the trial has them.

    What it sees of the bins is found by rays along the camera's way, with its own field of view.

    Args:
        phases: The phases of the trial.
        story: Path of its story; None for the usual one.
        house: Its house.
        person: Who watches.

    Raises:
        ConfigError: The story cannot be read.
    """
    ended = tuple(_phases(phases, story, house, person))
    seen = next((frozenset(end["bins"]) for end in ended if "bins" in end), None)
    return Familiarisation(ended, seen)


def watch_flythrough(house: House, person: PersonParameters) -> dict[str, Any]:
    """What `phase_ended` says of a fly-through that somebody watches."""
    path = camera_path(house)
    seen = bins_seen(house, path, FieldOfView.of(person), person.looking_interval)
    return {"phase": FLYTHROUGH, "duration_s": round(path.duration, 6), "bins": seen}


def _phases(
    phases: Collection[str], story: str | None, house: House, person: PersonParameters
) -> Iterator[dict[str, Any]]:
    if STORY in phases:
        text = story_text(None if story is None else Path(story))
        yield {"phase": STORY, "duration_s": round(reading_time(text), 6)}
    if FLYTHROUGH in phases:
        yield watch_flythrough(house, person)
