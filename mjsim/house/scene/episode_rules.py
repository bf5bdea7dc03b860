"""Rules that check whether the objects and the start position of an episode are valid in its house."""

import re
from collections import Counter
from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.sites import RoomMap
from mjsim.house.compiled.standing import StandingPlaces
from mjsim.house.scene.avatar import PREFIX, TRUNK
from mjsim.house.validation.findings import Finding
from mjsim.values.episode import Episode, PlacedObject
from mjsim.values.person_parameters import PersonParameters

MAX_OBJECTS = 200
FULL = 8  # number of objects that every receptacle can hold
HEIGHTS = (-0.02, 1.5)  # minimum and maximum height of an object's origin, in metres
UNIT = 0.01  # tolerance for the norm of a quaternion, which should be 1
OVERLAP = 0.005  # maximum depth by which objects may overlap at the start of an episode, in metres
REACH = PersonParameters().reach  # maximum distance from an object to the walkable floor, in metres
OUTSIDE = 0.05  # maximum distance of an object from the nearest room, in metres
NAME = re.compile(r"[A-Za-z0-9_.-]+")


def check_fit(episode: Episode, catalogue: Catalogue) -> Iterator[Finding]:
    """Check that an episode is consistent with the catalogue of its house."""
    if len(episode.objects) > MAX_OBJECTS:
        yield _episode("objects", f"has {len(episode.objects)} objects", f"use at most {MAX_OBJECTS}")
    unknown = sorted(set(episode.receptacles) - set(catalogue.receptacles))
    if unknown:
        yield _episode(
            "receptacles",
            f"names the receptacles {unknown}, which catalogue {catalogue.name!r} does not have",
            f"it has {sorted(catalogue.receptacles)}",
        )
    for placed in episode.objects:
        yield from _check_object(placed, episode.targets[placed.name], catalogue)
    for key, count in Counter(episode.targets.values()).items():
        if count > FULL:
            yield Finding(
                "objects",
                f"receptacle {key}",
                f"has to take {count} objects",
                f"give it {FULL} at most, or see that they fit",
                "warning",
            )


def _check_object(placed: PlacedObject, target: str, catalogue: Catalogue) -> Iterator[Finding]:
    name = placed.name
    if not NAME.fullmatch(name) or name in catalogue.receptacles or f"{name}/" == PREFIX:
        remedy = "use letters, digits and _, such as object_07, and not the key of a receptacle"
        yield Finding("names", f"object {name!r}", "has a name that cannot be used in a scene", remedy)
    model = catalogue.objects.get(placed.model)
    if model is None:
        message = f"is a {placed.model!r}, which catalogue {catalogue.name!r} does not have"
        yield Finding("objects", name, message, f"it has {sorted(catalogue.objects)}")
        return
    receptacle = catalogue.categories[model.category].receptacle
    if placed.category != model.category:
        message = f"is of category {placed.category!r}, but a {placed.model!r} is of {model.category!r}"
        yield Finding("objects", name, message, "correct the category or the model")
    elif target != receptacle:
        message = f"is to go into {target!r}, but {model.category!r} go into {receptacle!r}"
        yield Finding("receptacles", name, message, "correct its target")


def check_poses(episode: Episode, rooms: RoomMap) -> Iterator[Finding]:
    """Check that all objects have valid poses, and that the start position is inside the house."""
    start = episode.start
    if not rooms.contains((start.x, start.y), margin=OUTSIDE):
        yield Finding(
            "start",
            "start",
            f"at ({start.x:.2f}, {start.y:.2f}) lies outside of every room",
            "move it into one",
            place=(start.x, start.y, 0.0),
        )
    for placed in episode.objects:
        for message, remedy in _pose_faults(placed, rooms):
            yield Finding("poses", placed.name, message, remedy, place=placed.position)


def _pose_faults(placed: PlacedObject, rooms: RoomMap) -> Iterator[tuple[str, str]]:
    """Yield a message and a hint for each fault in an object's pose."""
    norm, (x, y, z) = float(np.linalg.norm(placed.quaternion)), placed.position
    if abs(norm - 1.0) > UNIT:
        message = f"has the quaternion {list(placed.quaternion)} of norm {norm:.3g}"
        yield message, "give one of norm 1, such as (1, 0, 0, 0)"
    if not HEIGHTS[0] <= z <= HEIGHTS[1]:
        yield f"is at z = {z:.2f} m", "put it onto the floor: z = 0"
    elif not rooms.contains((x, y), margin=OUTSIDE):
        yield f"at ({x:.2f}, {y:.2f}) lies outside of every room", "move it into one"


def check_overlaps(episode: Episode, model: mujoco.MjModel, owner: NDArray[np.int32]) -> Iterator[Finding]:
    """Find overlaps at the start of an episode. `owner` (ngeom,) is the object index of each geom, or -1."""
    data = mujoco.MjData(model)
    mujoco.mj_fwdPosition(model, data)
    trunk = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, TRUNK)
    deep = np.flatnonzero(data.contact.dist < -OVERLAP) if data.ncon else ()
    reported = set()
    for contact in deep:
        first, second = sorted(data.contact.geom[contact].tolist(), key=lambda g: (owner[g] < 0, g))
        # The trunk of the person collides only with the house, not with objects.
        if trunk in (first, second):
            what, subject = "a wall or a piece of furniture", "start"
        elif owner[first] < 0:
            continue
        else:
            subject = episode.objects[owner[first]].name
            other = int(owner[second])
            what = episode.objects[other].name if other >= 0 else "a wall, the floor or a piece of furniture"
            if model.geom(second).name.startswith(PREFIX):
                continue
        if (subject, what) not in reported:
            reported.add((subject, what))
            yield Finding(
                "overlap",
                subject,
                f"overlaps {what} by {-1000 * data.contact.dist[contact]:.0f} mm",
                "move it to where it lies free",
                place=tuple(data.contact.pos[contact].tolist()),
            )


def check_reach(episode: Episode, standing: StandingPlaces) -> Iterator[Finding]:
    """Check that a person can stand at the start position and can reach every object."""
    navigable = standing.navigable
    places = [("start", (episode.start.x, episode.start.y), 0.25)]
    places += [(o.name, o.position[:2], REACH) for o in episode.objects]
    for subject, xy, limit in places:
        gap = float(np.hypot(*(navigable.snap(xy, np.inf) - xy)))
        if gap > limit:
            yield Finding(
                "reach",
                subject,
                f"at ({xy[0]:.2f}, {xy[1]:.2f}) is {gap:.2f} m from where a person can walk",
                f"move it to at most {limit} m",
                place=(*xy, 0.0),
            )
    for placed in episode.objects:
        at = np.array(placed.position[:2])
        if standing.needs_doorway(at, navigable.snap(at, np.inf)):
            yield Finding(
                "reach",
                placed.name,
                f"at ({at[0]:.2f}, {at[1]:.2f}) cannot be reached in a straight line, except perhaps from a doorway",
                "move it away from walls and doorways",
                "warning",
                place=(*at, 0.0),
            )


def _episode(rule: str, message: str, remedy: str) -> Finding:
    return Finding(rule, "episode", message, remedy)
