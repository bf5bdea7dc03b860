"""Episodes, which consist of a disorganized house and a start pose, and their JSON format."""

import dataclasses
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from mjsim.support.files import read_json, read_text, write_text_atomically
from mjsim.values.errors import EpisodeError, brief

FORMAT_VERSION = 1
CAPACITY = 2  # maximum number of objects that a person can carry (PAPER section 2)
POINTS = 40  # default number of points in a house where objects can be dropped
FLOOR_SHARE = 0.4  # minimum share of these points that are on the floor; the others are on furniture


@dataclass(frozen=True)
class StartPose:
    """The initial pose of the person, with x and y in metres and the heading in radians."""

    x: float
    y: float
    heading: float


@dataclass(frozen=True)
class PlacedObject:
    """A misplaced object that rests on the floor or on furniture."""

    name: str  # unique instance name in the episode, such as `object_07`
    category: str  # catalogue key of the category, such as `dishes`
    model: str  # catalogue key of the object model, such as `mug`
    point: tuple[float, float]  # point (x, y) at which the object was dropped, in metres
    position: tuple[float, float, float]  # position of the origin after settling, in metres
    quaternion: tuple[float, float, float, float]  # wxyz quaternion after settling


@dataclass(frozen=True)
class Episode:
    """A house with misplaced objects, their target receptacles and a start pose (PAPER section 4).

    Attributes:
        house: Name of the house, or path of its catalogue.
        objects: Misplaced objects. N objects are at the first N sampled points of the house.
        receptacles: Keys of all receptacles in the house.
        targets: Key of the target receptacle of each object, by instance name.
    """

    house: str
    seed: int
    start: StartPose
    objects: tuple[PlacedObject, ...]
    receptacles: tuple[str, ...]
    targets: dict[str, str]

    def __post_init__(self) -> None:
        names = [o.name for o in self.objects]
        if len(set(names)) != len(names):
            raise EpisodeError(f"object names must be unique, got {names}")
        if set(self.targets) != set(names):
            raise EpisodeError(
                f"targets must name every object exactly once; differs at {sorted(set(self.targets) ^ set(names))}"
            )
        for name, receptacle in self.targets.items():
            if receptacle not in self.receptacles:
                raise EpisodeError(
                    f"target of {name} is {receptacle!r}, which is none of the receptacles {list(self.receptacles)}"
                )
        if not 0 <= self.seed < 2**63:
            raise EpisodeError(f"the seed is {self.seed}; give a whole number from 0 to 2^63 - 1")
        if not all(math.isfinite(v) for v in (self.start.x, self.start.y, self.start.heading)):
            raise EpisodeError(f"the start is not finite: {self.start}; give x and y in m, heading in rad")
        for placed in self.objects:
            if not all(math.isfinite(v) for v in (*placed.point, *placed.position, *placed.quaternion)):
                raise EpisodeError(
                    f"pose of {placed.name} is not finite: {placed.position} {placed.quaternion}"
                )

    def to_json(self) -> str:
        """Serialize the episode as JSON, with full float precision and a fixed order of keys."""
        return json.dumps({"format": FORMAT_VERSION, **dataclasses.asdict(self)}, indent=2) + "\n"

    @classmethod
    def from_json(cls, text: str) -> "Episode":
        """Create an episode from the output of `to_json`.

        Raises:
            EpisodeError: The text is not JSON, its format version is unknown, or fields are missing or ill-typed.
        """
        try:
            found = msgspec.json.decode(text, type=_Header).format
            if found is True or found != FORMAT_VERSION:  # True equals 1 in Python
                raise EpisodeError(
                    f"episode format {found!r} is not {FORMAT_VERSION}; sample it again with this version"
                )
            episode = msgspec.json.decode(text, type=cls)
            _check_fields(read_json(text))
            return episode
        except msgspec.ValidationError as error:
            raise EpisodeError(f"episode is malformed: {error}; sample it again") from error
        except (ValueError, RecursionError) as error:
            raise EpisodeError(f"episode is not JSON: {error}") from error

    def save(self, path: Path) -> None:
        """Write the episode to a JSON file atomically."""
        write_text_atomically(path, self.to_json())

    @classmethod
    def load(cls, path: Path) -> "Episode":
        """Read an episode file.

        Raises:
            EpisodeError: The file is missing or malformed. The message names the file.
        """
        try:
            return cls.from_json(read_text(path))
        except OSError as error:
            raise EpisodeError(f"cannot read episode {path}: {error.strerror}") from error
        except UnicodeDecodeError as error:
            raise EpisodeError(
                f"episode {path} is not UTF-8 at byte {error.start}; save it as UTF-8"
            ) from error
        except EpisodeError as error:
            raise EpisodeError(brief(f"{path}: {error}")) from error


class _Header(msgspec.Struct):
    format: Any = None


def _check_fields(raw: dict[str, Any]) -> None:
    tables = [(Episode, "episode", raw), (StartPose, "start", raw["start"])]
    tables += [(PlacedObject, f"objects[{k}]", table) for k, table in enumerate(raw["objects"])]
    for kind, place, table in tables:
        known = {"format", *(field.name for field in dataclasses.fields(kind))}
        if unknown := sorted(set(table) - known):
            raise EpisodeError(f"{place} has the unknown field {unknown[0]!r}; correct or remove it")
