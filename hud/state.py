"""The class `HudState`, which describes everything that the HUD shows."""

import enum
from dataclasses import dataclass
from typing import Literal

Vec2 = tuple[float, float]
Vec3 = tuple[float, float, float]
Rgba = tuple[float, float, float, float]
Shape = Literal["sphere", "cylinder", "box"]
FLOORPLAN = "floorplan"  # key of the picture that shows the house from above


@dataclass(frozen=True)
class Marker:
    """A virtual object that is drawn in the house.

    Attributes:
        shape: `sphere`, `cylinder` (upright) or `box`.
        position: Centre in the house frame, in metres.
        size: Sizes in metres. size[0] is the radius of a sphere or cylinder, and size[1] is half the length
            of a cylinder. The sizes of a box are half its side lengths.
        rgba: Red, green, blue and opacity, each from 0 to 1.
        role: Purpose: `breadcrumb`, `rim` (of a breadcrumb), `flagpole`, `goal` or `bin`.
        x_ray: True if the marker is also visible through walls, where it appears dimmed.
        object: Instance name of the object below the marker, or None.
        outlined: True if the marker is a sphere with a dark outline.
    """

    shape: Shape
    position: Vec3
    size: Vec3
    rgba: Rgba
    role: str
    x_ray: bool = False
    object: str | None = None
    outlined: bool = False


class MessageKind(enum.Enum):
    """The type of a message, which determines its colour and symbol."""

    INFO = "info"
    SUCCESS = "success"
    REFUSAL = "refusal"


@dataclass(frozen=True)
class Message:
    """A message with its current opacity, from 0 (invisible) to 1."""

    text: str
    kind: MessageKind
    opacity: float = 1.0


@dataclass(frozen=True)
class ChecklistItem:
    r"""A row of the task list.

    Attributes:
        text: Label of the object ("Blue mug").
        detail: Second line of text, split at its line break if it is too long ("Pick up ·\\nKitchen").
        picture: Key of the object's picture, or None.
        target_picture: Key of the receptacle's picture, or None.
        number: Number of the step, or None in a list without an order.
        done: True if the row is crossed out.
        current: True for the row of the current step.
        carried: True if the object is in a hand. Such a row is crossed out in frames and marked in browsers.
    """

    text: str
    detail: str
    picture: str | None = None
    target_picture: str | None = None
    number: int | None = None
    done: bool = False
    current: bool = False
    carried: bool = False


@dataclass(frozen=True)
class BinEntry:
    """A receptacle in the list of bins. `place` is split at its line break if it is too long for one line."""

    label: str
    place: str
    picture: str | None = None


@dataclass(frozen=True)
class InventorySlot:
    """The contents of a hand. Both fields are None if the hand is empty."""

    label: str | None = None
    picture: str | None = None


@dataclass(frozen=True)
class Pointer:
    """An arrow at the edge of the view that points to a goal outside the view.

    Attributes:
        angle: Direction on the screen in radians, counter-clockwise from the right (pi/2 is up).
    """

    angle: float


@dataclass(frozen=True)
class MiniMap:
    """A map of the house with north (+y) at the top.

    Attributes:
        picture: Key of the picture that shows the house within `bounds`.
        bounds: Area (xmin, ymin, xmax, ymax) that the map shows, in metres.
        position: Position of the person in metres.
        heading: Heading of the person in radians, counter-clockwise from +x.
        path: Points on the path to the goal, in metres.
        objects: Floor positions in metres of the objects with a flagpole.
        goal: End of the path in metres, or None.
    """

    picture: str
    bounds: tuple[float, float, float, float]
    position: Vec2
    heading: float
    path: tuple[Vec2, ...] = ()
    objects: tuple[Vec2, ...] = ()
    goal: Vec2 | None = None


@dataclass(frozen=True)
class HudState:
    """The content of the HUD at one moment.

    Attributes:
        checklist_title: Heading of the task list ("Objects to find", "Your plan").
        checklist: Rows of the task list, from top to bottom.
        bins: Rows of the list of bins.
        inventory: Contents of the left and the right hand. If the capacity is one, the left value is None.
        message: Content of the message bar, or None.
        markers: Virtual objects in the house.
        rerouted: True if the breadcrumbs start at the person and are replaced when the person leaves them.
        delivered: Number of objects in their receptacles.
        total: Total number of objects.
        clock: Elapsed task time in seconds, or None to show no clock.
        pointer: Arrow towards a goal outside the view, or None.
        minimap: Map of the house, or None.
        scroll: Number of rows by which the participant has scrolled down the task list.
    """

    checklist_title: str
    checklist: tuple[ChecklistItem, ...]
    bins: tuple[BinEntry, ...]
    inventory: tuple[InventorySlot | None, InventorySlot]
    message: Message | None = None
    markers: tuple[Marker, ...] = ()
    rerouted: bool = False
    delivered: int = 0
    total: int = 0
    clock: float | None = None
    pointer: Pointer | None = None
    minimap: MiniMap | None = None
    scroll: int = 0
