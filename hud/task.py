"""`TaskView`: the state of the task as an assistance condition sees it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray

from hud.errors import TaskViewError
from hud.projection import CameraView
from hud.state import Message, Vec3
from hud.texts import HudTexts

Status = Literal["loose", "carried", "delivered"]
StepKind = Literal["pick", "place"]
_Value = TypeVar("_Value")


class TaskStep(NamedTuple):
    """A step of the task: to pick an object up, or to place it into its receptacle."""

    kind: StepKind
    object: str


class Alternative(NamedTuple):
    """A step that is possible next, with its regret.

    Attributes:
        kind: `pick` or `place`.
        object: Instance name.
        extra: Regret: extra length of the rest of the task compared with the best next step, m.
        at_least: True if `extra` is only a lower bound.
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
        label: Name shown to people ("Blue mug").
        picture: Key of its picture.
        category: Category key.
        room: Label of its present room.
        position: Present position in the house frame, m.
        status: `loose`, `carried` or `delivered`.
        receptacle: Key of its receptacle.
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


class PlanAhead(Protocol):
    """The planner's suggestion. Its properties may be computed at the first access."""

    @property
    def steps(self) -> tuple[TaskStep, ...]:
        """Remaining steps in planned order, the next one first. Empty without a planner."""
        ...

    @property
    def segment(self) -> NDArray[np.float64] | None:
        """See `TaskView.segment`."""
        ...

    @property
    def path(self) -> NDArray[np.float64] | None:
        """See `TaskView.path`."""
        ...

    @property
    def goal(self) -> Vec3 | None:
        """Position of the next step, m."""
        ...


@dataclass(frozen=True, eq=False)
class KnownPlan:
    """A `PlanAhead` with fixed values."""

    steps: tuple[TaskStep, ...] = ()
    segment: NDArray[np.float64] | None = None
    path: NDArray[np.float64] | None = None
    goal: Vec3 | None = None


@dataclass(frozen=True, eq=False)
class TaskView:
    """State of the task and of the plan, in the house frame.

    Attributes:
        objects: All objects of the task.
        receptacles: All receptacles, in the order in which they are listed.
        order: Object names in this participant's random order (PAPER section 5).
        texts: Words of the HUD.
        hands: Object names in the left and the right hand, or None.
        capacity: Largest number of objects that can be carried.
        steps_done: Successful picks and places so far, in order.
        ahead: Source of `plan`, `segment`, `path` and `goal`.
        position: Floor position of the person, m.
        eye: Position of the eye, m.
        eye_height: Height of the eye above the floor when the person looks straight ahead, m.
        message: Content of the message bar, or None.
        clock: Elapsed task time to show, s, or None.
        camera: The eye camera, which a pointer needs, or None.
        heading: Heading of the person, rad, 0 along +x, counter-clockwise.
        bounds: xmin, ymin, xmax, ymax of the house, m, or None without a map.
        scroll: Number of rows by which the person has scrolled the task list, positive towards its end.
        alternatives: Returns all steps that are possible next, or nothing until their regrets are known. Finding them
            takes time, so only conditions that show them should call it.

    Raises:
        TaskViewError: A name is unknown or repeated, or `order` is not a permutation of the objects.
    """

    objects: tuple[TaskObject, ...]
    receptacles: tuple[TaskReceptacle, ...]
    order: tuple[str, ...]
    texts: HudTexts
    hands: tuple[str | None, str | None] = (None, None)
    capacity: int = 2
    steps_done: tuple[TaskStep, ...] = ()
    ahead: PlanAhead = KnownPlan()
    position: tuple[float, float] = (0.0, 0.0)
    eye: Vec3 = (0.0, 0.0, 1.6)
    eye_height: float = 1.6
    message: Message | None = None
    clock: float | None = None
    camera: CameraView | None = None
    heading: float = 0.0
    bounds: tuple[float, float, float, float] | None = None
    scroll: int = 0
    alternatives: Callable[[], tuple[Alternative, ...]] = tuple

    def __post_init__(self) -> None:
        names = [o.name for o in self.objects]
        keys = [r.key for r in self.receptacles]
        for what, values in (("objects", names), ("receptacles", keys)):
            if len(set(values)) != len(values):
                raise TaskViewError(f"names of {what} must be unique, got {values}")
        if sorted(self.order) != sorted(names):
            raise TaskViewError(f"order {list(self.order)} must hold each object once: {names}")
        for o in self.objects:
            if o.receptacle not in keys:
                raise TaskViewError(f"{o.name} belongs to {o.receptacle!r}, none of the receptacles {keys}")
            if o.status not in get_args(Status):
                raise TaskViewError(f"status of {o.name} is {o.status!r}, must be one of {get_args(Status)}")
        self._check_steps(self.steps_done)
        for hand in self.hands:
            if hand is not None and hand not in names:
                raise TaskViewError(f"hands hold {hand!r}, which is none of {names}")

    @property
    def plan(self) -> tuple[TaskStep, ...]:
        """Remaining steps in planned order, the next one first. Empty without a planner."""
        self._check_steps(self.ahead.steps)
        return self.ahead.steps

    @property
    def segment(self) -> NDArray[np.float64] | None:
        """Shortest floor path from the place of the last step, or the start, to the next step, m, shape (k, 2).

        None if nothing is left to do.
        """
        return _checked_path("segment", self.ahead.segment)

    @property
    def path(self) -> NDArray[np.float64] | None:
        """Shortest floor path from the person to the next step, replaced when the person leaves it, m, shape (k, 2)."""
        return _checked_path("path", self.ahead.path)

    @property
    def goal(self) -> Vec3 | None:
        """Position of the next step's object or receptacle, m, or None."""
        return self.ahead.goal

    def object(self, name: str) -> TaskObject:
        """Return the object called `name`. Raises TaskViewError if there is none."""
        return _named("object", {o.name: o for o in self.objects}, name)

    def receptacle(self, key: str) -> TaskReceptacle:
        """Return the receptacle called `key`. Raises TaskViewError if there is none."""
        return _named("receptacle", {r.key: r for r in self.receptacles}, key)

    def _check_steps(self, steps: tuple[TaskStep, ...]) -> None:
        names = [o.name for o in self.objects]
        for kind, name in steps:
            if kind not in get_args(StepKind) or name not in names:
                raise TaskViewError(f"step {(kind, name)} must be a pick or place of one of {names}")


def _named(what: str, values: Mapping[str, _Value], name: str) -> _Value:
    if name not in values:
        raise TaskViewError(f"no {what} {name!r}; there are {list(values)}")
    return values[name]


def _checked_path(what: str, path: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
    if path is None:
        return None
    shaped = path.ndim == 2 and path.shape[1] == 2 and len(path) >= 1
    if not shaped or not np.isfinite(path).all():
        raise TaskViewError(f"{what} must be finite with shape (k, 2), k >= 1, got shape {path.shape}")
    return path
