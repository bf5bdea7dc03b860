"""Familiarize simulated participants with a story and a fly-through (PAPER sections 4 and 7)."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.errors import ConfigError
from experiments.house import House
from experiments.record.phases import FLYTHROUGH, STORY, TRAINING
from experiments.record.records import PHASE_BEGUN, PHASE_ENDED, Event, EventLog
from experiments.session.camera_path import bins_seen, camera_path
from hud.lists import in_sentence
from hud.texts import filled
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.sight.sight import FieldOfView
from mjsim.support.files import read_text
from mjsim.values.person_parameters import PersonParameters

STORY_FILE = Path(__file__).with_name("story.md")
READING_SPEED = 238.0  # speed in words per minute (Brysbaert, Journal of Memory and Language 109, 2019)


@dataclass(frozen=True)
class Familiarisation:
    """The phases that a simulated participant goes through before the task."""

    ended: tuple[dict[str, Any], ...]  # fields of the `phase_ended` event of each phase, in order
    seen: frozenset[str] | None  # keys of the bins that the participant has seen, or None if all are known

    def trained(self, events: Sequence[Event]) -> "Familiarisation":
        """Return a copy that includes a training. Bins that were used in the training count as seen."""
        used = {event["receptacle"] for event in events if event["event"] == "placed"}
        end = {"phase": TRAINING, "duration_s": events[-1]["t"], "reason": events[-1]["reason"]}
        return Familiarisation((*self.ended, end), None if self.seen is None else self.seen | used)

    def log(self, log: EventLog) -> None:
        """Log the phases at time 0, because they take place before the task clock starts."""
        for end in self.ended:
            log.append(0.0, PHASE_BEGUN, phase=end["phase"])
            log.append(0.0, PHASE_ENDED, **end)


def familiarise(
    phases: Collection[str], story: str | None, house: House, person: PersonParameters
) -> Familiarisation:
    """Let a simulated participant read the story and watch the fly-through, if the trial has these phases.

    A bin counts as seen if it is visible from the camera path within the participant's own field of view.
    """
    ended = tuple(_phases(phases, story, house, person))
    seen = next((frozenset(end["bins"]) for end in ended if "bins" in end), None)
    return Familiarisation(ended, seen)


def watch_flythrough(house: House, person: PersonParameters) -> dict[str, Any]:
    """Simulate watching the fly-through, and return the fields of its `phase_ended` event."""
    path = camera_path(house)
    seen = bins_seen(house, path, FieldOfView.of(person), person.looking_interval)
    return {"phase": FLYTHROUGH, "duration_s": round(path.duration, 6), "bins": seen}


def _phases(
    phases: Collection[str], story: str | None, house: House, person: PersonParameters
) -> Iterator[dict[str, Any]]:
    if STORY in phases:
        text = with_names(story_text(None if story is None else Path(story)), house.catalogue)
        yield {"phase": STORY, "duration_s": round(reading_time(text), 6)}
    if FLYTHROUGH in phases:
        yield watch_flythrough(house, person)


def story_text(path: Path | None = None) -> str:
    """Read the story from a UTF-8 file, or the default story. Blank lines separate paragraphs.

    Names of bins are still placeholders (see `with_names`).
    """
    file = path or STORY_FILE
    try:
        text = read_text(file).strip()
    except OSError as error:
        raise ConfigError(f"cannot read the story {file}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"the story {file} is not UTF-8: {error}") from error
    if not text:
        raise ConfigError(f"the story {file} is empty; write at least one sentence")
    return text


def with_names(story: str, catalogue: Catalogue) -> str:
    """Fill in the bins of a house and the categories of its objects, in the language of the catalogue.

    `{bins}` and `{categories}` are lists of labels within a sentence ("dish bin, toy box"). `{Bins}` and
    `{Categories}` list the labels themselves ("Dish bin, Toy box"). `{count}` is the number of bins.
    """
    labels = {
        "bins": [receptacle.label for receptacle in catalogue.receptacles.values()],
        "categories": [category.label for category in catalogue.categories.values()],
    }
    inside = {name: ", ".join(map(in_sentence, found)) for name, found in labels.items()}
    plain = {name.capitalize(): ", ".join(found) for name, found in labels.items()}
    return filled(story, count=len(catalogue.receptacles), **inside, **plain)


def reading_time(text: str) -> float:
    """Return the time in seconds that an adult needs to read a text silently."""
    return 60.0 * len(text.split()) / READING_SPEED
