"""HudState: everything the person is shown, as one value. Drawing is a pure function of it."""

import enum
from dataclasses import dataclass
from typing import Literal

Vec2 = tuple[float, float]
Vec3 = tuple[float, float, float]
Rgba = tuple[float, float, float, float]
Shape = Literal["sphere", "cylinder", "box"]


@dataclass(frozen=True)
class Marker:
    """A world-locked digital object.

    Attributes:
        shape: `sphere` (size[0] radius), `cylinder` (size[0] radius, size[1] half-length, upright) or
            `box` (half-sizes).
        position: Centre in the house frame, m.
        size: Sizes in m; meaning by shape.
        rgba: Colour, components in 0..1.
        role: What it is for: `breadcrumb`, `rim` (of a breadcrumb), `flagpole`, `goal`, `bin`.
        x_ray: Whether it also shows, dimmed, through walls.
        object: Instance name of the object that it stands over, or None.
        outlined: Whether a sphere has a dark outline.
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
    """Kind of message, which decides its colour and symbol."""

    INFO = "info"
    SUCCESS = "success"
    REFUSAL = "refusal"


@dataclass(frozen=True)
class Message:
    """Text of the message bar, and its opacity at this moment: 1 opaque, 0 gone."""

    text: str
    kind: MessageKind
    opacity: float = 1.0


@dataclass(frozen=True)
class ChecklistItem:
    """A row of the task list.

    Attributes:
        text: The object ("Blue mug").
        detail: Below the text: where the object is, where it goes, what to do. Broken at its line break if it does
            not fit in one line ("Kitchen\\n→ Dish bin", "Pick up ·\\nKitchen").
        picture: Key of the object's picture, or None.
        target_picture: Key of the receptacle's picture, or None.
        number: Step number, or None where order means nothing.
        done: Crossed out.
        carried: Crossed out, but in a hand: what the page of a person marks in another way.
        current: The step to do now.
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
    """A receptacle in the list that every condition shows: picture, name and semantic location.

    `place` is broken at its line break if it does not fit in one line.
    """

    label: str
    place: str
    picture: str | None = None


@dataclass(frozen=True)
class InventorySlot:
    """One hand: what it holds, or nothing."""

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
        position: Where the person stands, m.
        heading: Where the person looks, rad, 0 along +x, counter-clockwise.
        path: Points along the path to the goal, m.
        objects: Floor positions of the objects that have a flagpole, m.
        goal: Where the path ends, m, or None.
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
        inventory: Left and right hand; no left one for a person who carries one object at most.
        message: Message bar, or None.
        markers: World-locked objects.
        rerouted: Whether the breadcrumbs start at the person and are replaced when the person leaves them.
        delivered: How many objects are in their receptacle.
        total: How many there are.
        clock: Elapsed task time to show, s, or None.
        pointer: Arrow towards a goal out of view, or None.
        minimap: The house from above, or None.
        scroll: By how many rows the task list is scrolled from where it follows the task, positive towards its end.
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
