"""`HudState`: everything that the person is shown, as one value."""

import enum
from dataclasses import dataclass
from typing import Literal

Vec2 = tuple[float, float]
Vec3 = tuple[float, float, float]
Rgba = tuple[float, float, float, float]
Shape = Literal["sphere", "cylinder", "box"]
FLOORPLAN = "floorplan"  # key of the picture of the house from above


@dataclass(frozen=True)
class Marker:
    """A virtual object in the world.

    Attributes:
        shape: `sphere` (size[0] is the radius), `cylinder` (upright; size[0] is the radius, size[1] half the length) or
            `box` (half sizes).
        position: Centre in the house frame, m.
        size: Sizes, m. Their meaning depends on the shape.
        rgba: Colour, components in 0..1.
        role: Purpose: `breadcrumb`, `rim` (of a breadcrumb), `flagpole`, `goal` or `bin`.
        x_ray: True if the marker also shows, dimmed, through walls.
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
    """Kind of a message. It determines colour and symbol."""

    INFO = "info"
    SUCCESS = "success"
    REFUSAL = "refusal"


@dataclass(frozen=True)
class Message:
    """Text of the message bar, with its present opacity: 1 opaque, 0 gone."""

    text: str
    kind: MessageKind
    opacity: float = 1.0


@dataclass(frozen=True)
class ChecklistItem:
    r"""A row of the task list.

    Attributes:
        text: Label of the object ("Blue mug").
        detail: Second line, broken at its line break if it is too long ("Kitchen\\n→ Dish bin", "Pick up ·\\nKitchen").
        picture: Key of the object's picture, or None.
        target_picture: Key of the receptacle's picture, or None.
        number: Step number, or None in a list without an order.
        done: True if the row is crossed out.
        current: True for the step to do now.
        carried: True if the object is in a hand. Such a row is crossed out in frames; the browser page marks it.
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
    """A receptacle in the list of bins. `place` is broken at its line break if it is too long for one line."""

    label: str
    place: str
    picture: str | None = None


@dataclass(frozen=True)
class InventorySlot:
    """Contents of a hand. Both fields are None if it is empty."""

    label: str | None = None
    picture: str | None = None


@dataclass(frozen=True)
class Pointer:
    """An arrow at the edge of the view towards a goal that is out of view.

    Attributes:
        angle: Direction on the screen, rad, 0 to the right, counter-clockwise (pi/2 is up).
    """

    angle: float


@dataclass(frozen=True)
class MiniMap:
    """The house from above with north (+y) up.

    Attributes:
        picture: Key of the picture that shows the house within `bounds`.
        bounds: xmin, ymin, xmax, ymax, m.
        position: Position of the person, m.
        heading: Heading of the person, rad, 0 along +x, counter-clockwise.
        path: Points along the path to the goal, m.
        objects: Floor positions of the objects that have a flagpole, m.
        goal: End of the path, m, or None.
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
    """Everything that is shown.

    Attributes:
        checklist_title: Heading of the task list ("Objects to find", "Your plan").
        checklist: Rows, in the order shown.
        bins: The list of receptacles.
        inventory: Left and right hand. The left one is None for a person who carries one object at most.
        message: Message bar, or None.
        markers: Virtual objects in the world.
        rerouted: True if the breadcrumbs start at the person and are replaced when the person leaves them.
        delivered: Number of objects in their receptacles.
        total: Number of all objects.
        clock: Elapsed task time, s, or None to show no clock.
        pointer: Arrow towards a goal out of view, or None.
        minimap: The house from above, or None.
        scroll: Number of rows by which the person has scrolled the task list, positive towards its end.
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
