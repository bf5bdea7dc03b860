"""`HudState`: everything that the HUD shows, as one value."""

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
    """A virtual object in the world.

    Attributes:
        shape: `sphere` (size[0] is the radius), upright `cylinder` (size[0] is the radius, size[1] half the length) or
            `box` (half sizes).
        position: Centre in the house frame, in metres.
        size: Sizes in metres. Their meaning depends on the shape.
        rgba: Colour, with components from 0 to 1.
        role: Purpose: `breadcrumb`, `rim` (of a breadcrumb), `flagpole`, `goal` or `bin`.
        x_ray: True if the marker is also visible through walls, where it appears dimmed.
        object: Instance name of the object below the marker, or None.
        outlined: True if a sphere has a dark outline.
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
    """Type of a message, which determines its colour and symbol."""

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
        detail: Second line, split at its line break if too long ("Kitchen\\n→ Dish bin", "Pick up ·\\nKitchen").
        picture: Key of the object's picture, or None.
        target_picture: Key of the receptacle's picture, or None.
        number: Step number, or None in a list without an order.
        done: True if the row is crossed out.
        current: True for the row of the current step.
        carried: True if the object is in a hand. Frames cross out such a row, and the browser page marks it.
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
    """A receptacle in the list of bins. `place` is broken at its line break if it does not fit on one line."""

    label: str
    place: str
    picture: str | None = None


@dataclass(frozen=True)
class InventorySlot:
    """Contents of a hand. Both fields are None if the hand is empty."""

    label: str | None = None
    picture: str | None = None


@dataclass(frozen=True)
class Pointer:
    """An arrow at the edge of the view towards a goal outside it.

    Attributes:
        angle: Direction on the screen in radians, counter-clockwise from the right (pi/2 is up).
    """

    angle: float


@dataclass(frozen=True)
class MiniMap:
    """A map of the house with north (+y) up.

    Attributes:
        picture: Key of the picture that shows the house within `bounds`.
        bounds: (xmin, ymin, xmax, ymax) in metres.
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
    """Everything that the HUD shows.

    Attributes:
        checklist_title: Heading of the task list ("Objects to find", "Your plan").
        checklist: Rows of the task list, from top to bottom.
        bins: Rows of the list of bins.
        inventory: Contents of the left and the right hand. The left one is None if the capacity is one.
        message: Content of the message bar, or None.
        markers: Virtual objects in the world.
        rerouted: True if the breadcrumbs start at the person and are replaced when the person leaves them.
        delivered: Number of objects in their receptacles.
        total: Number of all objects.
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
