"""The class `TaskView`, which describes the state of the task to an assistance condition."""

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
    """A step of the task, in which an object is picked up or placed into its receptacle."""

    kind: StepKind
    object: str


class Alternative(NamedTuple):
    """A possible next step and its regret.

    Attributes:
        kind: `pick` or `place`.
        object: Instance name of the object.
        extra: Regret in metres, which is the extra length of the remaining tour compared with the best step.
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
        label: Name to display ("Blue mug").
        picture: Key of the object's picture, or None.
        category: Key of the object's category.
        room: Label of the room in which the object is.
        position: Current position in the house frame, in metres.
        status: `loose`, `carried` or `delivered`.
        receptacle: Key of the object's receptacle.
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
    """A receptacle. `place` is its location in the room, such as "on the counter, beside the sink"."""

    key: str
    label: str
    place: str
    room: str
    picture: str | None
    position: Vec3


class PlanAhead(Protocol):
    """The interface of a planner's suggestion. Properties may be computed when they are first read."""

    @property
    def steps(self) -> tuple[TaskStep, ...]:
        """The remaining steps in planned order. Empty if there is no planner."""
        ...

    @property
    def segment(self) -> NDArray[np.float64] | None:
        """The path that `TaskView.segment` returns."""
        ...

    @property
    def path(self) -> NDArray[np.float64] | None:
        """The path that `TaskView.path` returns."""
        ...

    @property
    def goal(self) -> Vec3 | None:
        """The position of the next step in metres, or None."""
        ...


@dataclass(frozen=True, eq=False)
class KnownPlan:
    """A planner's suggestion whose values are already known."""

    steps: tuple[TaskStep, ...] = ()
    segment: NDArray[np.float64] | None = None
    path: NDArray[np.float64] | None = None
    goal: Vec3 | None = None


@dataclass(frozen=True, eq=False)
class TaskView:
    """The state of the task and of the plan. All positions are in the house frame.

    Attributes:
        objects: All objects of the task.
        receptacles: All receptacles, in the order in which they are listed.
        order: Object names in this participant's random order (PAPER section 5).
        texts: Texts of the HUD.
        hands: Names of the objects in the left and the right hand. None for an empty hand.
        capacity: Maximum number of objects that can be carried.
        steps_done: Successful picks and places so far, in order.
        ahead: Source of `plan`, `segment`, `path` and `goal`.
        position: Floor position of the person in metres.
        eye: Position of the eye in metres.
        eye_height: Height in metres of the eye above the floor when the person looks straight ahead.
        message: Content of the message bar, or None.
        clock: Elapsed task time in seconds, or None to show no clock.
        camera: Eye camera, or None. The option `pointer` needs it.
        heading: Heading of the person in radians, counter-clockwise from +x.
        bounds: Area (xmin, ymin, xmax, ymax) of the house in metres, or None to show no map.
        scroll: Number of rows by which the participant has scrolled down the task list.
        alternatives: Function that returns all possible next steps, or an empty tuple until their regrets are
            known. Finding regrets takes time, so only conditions that show them should call it.

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
        """The remaining steps in planned order. Empty if there is no planner."""
        self._check_steps(self.ahead.steps)
        return self.ahead.steps

    @property
    def segment(self) -> NDArray[np.float64] | None:
        """The shortest floor path (k, 2), in metres, from the last step (or the start) to the next step.

        None if no step is left.
        """
        return _checked_path("segment", self.ahead.segment)

    @property
    def path(self) -> NDArray[np.float64] | None:
        """The shortest floor path (k, 2), in metres, from the person to the next step, or None.

        The path is replaced with a new one when the person leaves it.
        """
        return _checked_path("path", self.ahead.path)

    @property
    def goal(self) -> Vec3 | None:
        """The position of the next step's object or receptacle in metres, or None."""
        return self.ahead.goal

    def object(self, name: str) -> TaskObject:
        """Return the object with this name. Raises TaskViewError if there is none."""
        return _named("object", {o.name: o for o in self.objects}, name)

    def receptacle(self, key: str) -> TaskReceptacle:
        """Return the receptacle with this key. Raises TaskViewError if there is none."""
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
