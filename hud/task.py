"""TaskView: what an assistance condition sees of the task, as one value."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from hud.errors import TaskViewError
from hud.projection import CameraView
from hud.state import Message, Vec3

Status = Literal["loose", "carried", "delivered"]
StepKind = Literal["pick", "place"]


class PlannedStep(NamedTuple):
    """One visit: pick an object up, or place it into its receptacle."""

    kind: StepKind
    object: str


class Alternative(NamedTuple):
    """A visit that is possible next, and by how much it makes the rest of the task longer than the best one, m.

    `at_least`: that is only a lower bound.
    """

    kind: StepKind
    object: str
    extra: float
    at_least: bool = False


@dataclass(frozen=True)
class TaskObject:
    """An object that has to be put away.

    Attributes:
        name: Instance name, unique in the task.
        label: What people call it ("Blue mug").
        picture: Key of its picture.
        category: Category key.
        room: Label of the room it is in now.
        position: Its position now, m, house frame.
        status: `loose`, `carried` or `delivered`.
        receptacle: Key of the receptacle it belongs to.
    """

    name: str
    label: str
    picture: str | None
    category: str
    room: str
    position: Vec3
    status: Status
    receptacle: str


@dataclass(frozen=True)
class TaskReceptacle:
    """A receptacle: `place` is a phrase ("on the counter, beside the sink"), `room` the room's label."""

    key: str
    label: str
    place: str
    room: str
    picture: str | None
    position: Vec3


@dataclass(frozen=True, eq=False)
class TaskView:
    """State of the task and of the plan, in the house frame.

    Attributes:
        objects: All objects of the task.
        receptacles: All receptacles, in the order in which they are listed.
        order: Object names in this participant's random order (PAPER section 5).
        hands: Object name in the left and in the right hand, or None.
        steps_done: Feasible visits already made, in order.
        plan: Remaining visits in planned order, the next one first; empty without a planner.
        path: Floor polyline from the person to the goal of the next visit, m, shape (k, 2), or None.
        goal: Where the next visit happens (the object, or its receptacle), m, or None.
        position: Floor position of the person, m.
        eye: Position of the eye, m.
        message: What the message bar shows, or None.
        clock: Elapsed task time to show, s, or None.
        camera: The eye camera; given, the optimal condition points to a goal that is out of view.
        heading: Where the person looks, rad, 0 along +x, counter-clockwise.
        bounds: xmin, ymin, xmax, ymax of the house, m, or None where there is no map of it.
        alternatives: Gives all visits that are possible next, worked out only when asked; none as long as nothing is
            known of them.

    Raises:
        TaskViewError: A name is unknown or repeated, `order` is not a permutation of the objects, or `path`
            has the wrong shape or is not finite.
    """

    objects: tuple[TaskObject, ...]
    receptacles: tuple[TaskReceptacle, ...]
    order: tuple[str, ...]
    hands: tuple[str | None, str | None] = (None, None)
    steps_done: tuple[tuple[StepKind, str], ...] = ()
    plan: tuple[PlannedStep, ...] = ()
    path: NDArray[np.float64] | None = None
    goal: Vec3 | None = None
    position: tuple[float, float] = (0.0, 0.0)
    eye: Vec3 = (0.0, 0.0, 1.6)
    message: Message | None = None
    clock: float | None = None
    camera: CameraView | None = None
    heading: float = 0.0
    bounds: tuple[float, float, float, float] | None = None
    alternatives: Callable[[], tuple[Alternative, ...]] = tuple

    def __post_init__(self) -> None:
        names = [o.name for o in self.objects]
        keys = [r.key for r in self.receptacles]
        for what, values in (("objects", names), ("receptacles", keys)):
            if len(set(values)) != len(values):
                raise TaskViewError(f"names of {what} must be unique, got {values}")
        if sorted(self.order) != sorted(names):
            raise TaskViewError(f"order {list(self.order)} must hold each object once: {names}")
        for thing in self.objects:
            if thing.receptacle not in keys:
                raise TaskViewError(
                    f"{thing.name} belongs to {thing.receptacle!r}, none of the receptacles {keys}"
                )
            if thing.status not in get_args(Status):
                raise TaskViewError(
                    f"status of {thing.name} is {thing.status!r}, must be one of {get_args(Status)}"
                )
        for kind, name in (*self.steps_done, *self.plan):
            if kind not in get_args(StepKind) or name not in names:
                raise TaskViewError(f"step {(kind, name)} must be a pick or place of one of {names}")
        for hand in self.hands:
            if hand is not None and hand not in names:
                raise TaskViewError(f"hands hold {hand!r}, which is none of {names}")
        if self.path is not None and (
            self.path.ndim != 2
            or self.path.shape[1] != 2
            or len(self.path) < 1
            or not np.isfinite(self.path).all()
        ):
            raise TaskViewError(f"path must be finite with shape (k, 2), k >= 1, got shape {self.path.shape}")

    def object(self, name: str) -> TaskObject:
        """The object called `name`.

        Raises:
            TaskViewError: There is none.
        """
        for candidate in self.objects:
            if candidate.name == name:
                return candidate
        raise TaskViewError(f"no object {name!r}; there are {[o.name for o in self.objects]}")

    def receptacle(self, key: str) -> TaskReceptacle:
        """The receptacle called `key`.

        Raises:
            TaskViewError: There is none.
        """
        for candidate in self.receptacles:
            if candidate.key == key:
                return candidate
        raise TaskViewError(f"no receptacle {key!r}; there are {[r.key for r in self.receptacles]}")
