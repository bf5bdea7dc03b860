"""Read rearrangement episodes of other benchmarks to find their misplaced objects.

A RoomR file (AI2-THOR rearrangement) contains start and goal poses. A Housekeep file contains the receptacle
of each object and the receptacles where the object belongs.
"""

import gzip
import io
import math
import pickle  # nosec B403: read by an unpickler that allows no class
import re
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import msgspec
import numpy as np

from mjsim.support.files import MAX_INPUT, read_bytes
from mjsim.values.errors import EpisodeError, brief

# Distance in metres above which an object counts as moved. Poses in RoomR vary by less between runs.
MOVED = 0.05
HOUSE = 60.0  # largest plausible distance in metres; only objects that fell out of the scene are farther away
IN_PLACE, MISPLACED, OPENED = "in place", "misplaced", "opened"


@dataclass(frozen=True)
class EpisodeObject:
    """An object in an imported episode."""

    scene: str
    episode: str
    name: str
    kind: str
    state: str  # `in place` or `misplaced` for an object, `opened` for a drawer or door
    # Horizontal distance to the goal in metres, or None if the object is in place or its goal is unknown.
    distance: float | None = None


class _Point(msgspec.Struct):
    x: float
    y: float
    z: float


class _Pose(msgspec.Struct):
    name: str
    position: _Point


class _Openable(msgspec.Struct):
    name: str


class _RoomR(msgspec.Struct):
    starting_poses: list[_Pose]
    target_poses: list[_Pose]
    openable_data: list[_Openable] = []


class _Housekeep(msgspec.Struct):
    scene_id: str
    episode_id: int | str
    objs_keys: list[str]
    objs_cats: list[str]
    objs_pos: list[tuple[float, float, float]]
    recs_pos: list[tuple[float, float, float]]
    start_matrix: list[list[float]]
    end_matrix: list[list[float]]


class _HousekeepFile(msgspec.Struct):
    episodes: list[_Housekeep]


class _NoClass(pickle._Unpickler):
    """An unpickler that accepts only plain containers, numbers and strings.

    It extends the unpickler in Python, because the one in C allocates as much memory as a file asks for.
    """

    def find_class(self, module: str, name: str) -> NoReturn:
        raise EpisodeError(f"names {module}.{name}, and only plain lists, tables, numbers and text are read")


def read_episodes(path: Path) -> list[EpisodeObject]:
    """Read an episode file of RoomR (`.pkl`, `.pkl.gz`) or of Housekeep (`.json`, `.json.gz`).

    Raises:
        EpisodeError: The file cannot be read, is invalid, or contains a class. Its code is never executed.
    """
    name = path.name.lower().removesuffix(".gz")
    reader = {".pkl": _read_roomr, ".json": _read_housekeep}.get(Path(name).suffix)
    if reader is None:
        raise EpisodeError(
            f"cannot read {path}: unknown kind of file; use .pkl.gz of RoomR or .json.gz of Housekeep"
        )
    try:
        found = reader(_unzipped(path))
    except OSError as error:
        raise EpisodeError(f"cannot read {path}: {error.strerror or error}; is it complete?") from error
    except (EpisodeError, msgspec.ValidationError, msgspec.DecodeError) as error:
        raise EpisodeError(brief(f"{path}: {error}")) from error
    if not found:
        raise EpisodeError(f"{path} has no objects; use a file with episodes")
    return found


def _unzipped(path: Path) -> bytes:
    data = read_bytes(path)
    if not path.name.lower().endswith(".gz"):
        return data
    try:
        with gzip.open(io.BytesIO(data)) as file:
            content = file.read(MAX_INPUT + 1)
    except (EOFError, zlib.error) as error:
        raise OSError(str(error)) from error
    if len(content) > MAX_INPUT:
        raise EpisodeError(f"holds more than {MAX_INPUT // 10**6} MB; split it")
    return content


def _read_roomr(data: bytes) -> list[EpisodeObject]:
    try:
        content = _NoClass(io.BytesIO(data)).load()
    except EpisodeError:
        raise
    except Exception as error:  # A damaged or malicious pickle can raise any exception.
        raise EpisodeError(
            f"not a pickle of plain values ({type(error).__name__}); is it complete?"
        ) from error
    scenes = msgspec.convert(content, dict[str, list[_RoomR]])
    return [
        found
        for scene, episodes in scenes.items()
        for number, episode in enumerate(episodes)
        for found in _roomr_objects(scene, str(number), episode)
    ]


def _roomr_objects(scene: str, number: str, episode: _RoomR) -> Iterator[EpisodeObject]:
    goals = {pose.name: pose.position for pose in episode.target_poses}
    for pose in episode.starting_poses:
        kind = pose.name.partition("_")[0]
        if pose.name not in goals:
            raise EpisodeError(f"{scene}, episode {number}: {pose.name!r} has no target pose")
        here, there = pose.position, goals[pose.name]
        moved = math.dist((here.x, here.y, here.z), (there.x, there.y, there.z)) > MOVED
        distance = _distance(math.hypot(here.x - there.x, here.z - there.z)) if moved else None
        yield EpisodeObject(scene, number, pose.name, kind, MISPLACED if moved else IN_PLACE, distance)
    for openable in episode.openable_data:
        yield EpisodeObject(scene, number, openable.name, openable.name.partition("_")[0], OPENED)


def _read_housekeep(data: bytes) -> list[EpisodeObject]:
    episodes = msgspec.json.decode(data, type=_HousekeepFile).episodes
    return [found for episode in episodes for found in _housekeep_objects(episode)]


def _housekeep_objects(episode: _Housekeep) -> Iterator[EpisodeObject]:
    scene, number = Path(episode.scene_id).stem, str(episode.episode_id)
    shape = len(episode.recs_pos), len(episode.objs_keys)
    try:
        start, end = (np.array(m, float).reshape(shape) for m in (episode.start_matrix, episode.end_matrix))
        objects, receptacles = (np.array(p).reshape(-1, 3) for p in (episode.objs_pos, episode.recs_pos))
        columns = zip(episode.objs_keys, episode.objs_cats, objects, start.T, end.T, strict=True)
        for name, kind, position, where, right in columns:
            if not where.any() or where @ right:
                yield EpisodeObject(scene, number, name, kind, IN_PLACE)
                continue
            offsets = (receptacles[right > 0] - position)[:, [0, 2]]  # The y axis points up.
            nearest = _distance(float(np.hypot(*offsets.T).min())) if len(offsets) else None
            yield EpisodeObject(scene, number, name, kind, MISPLACED, nearest)
    except ValueError as error:
        raise EpisodeError(
            f"{scene}, episode {number}: tables do not fit {shape[0]} places and {shape[1]} objects"
        ) from error


def _distance(metres: float) -> float | None:
    return round(metres, 3) if metres <= HOUSE else None


def kind_of(name: str) -> str:
    """Convert the name of an object type to words. For example, `ButterKnife` becomes `butter knife`."""
    return " ".join(re.findall(r"[A-Z]?[a-z0-9]+|[A-Z]+(?![a-z])", name)).lower()
