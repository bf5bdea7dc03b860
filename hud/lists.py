"""Building blocks of conditions, such as flagpoles and task lists in random order."""

import math
from collections.abc import Callable

from hud.markers import flagpole
from hud.state import BinEntry, ChecklistItem, HudState, InventorySlot, Marker, Pointer
from hud.task import TaskObject, TaskView

NEAR = 1.6  # distance in metres below which an object is close to the lower edge of the view


def in_sentence(label: str) -> str:
    """Adapt a label for use in a sentence: "Blue mug" becomes "blue mug", but "LEGO car" is unchanged."""
    first, _, rest = label.partition(" ")
    stem = first.partition("-")[0]
    plain = len(stem) > 1 and stem.isalpha() and first[:1].isupper() and first[1:].islower()
    return f"{first.lower()} {rest}".rstrip() if plain else label


def bins(view: TaskView) -> tuple[BinEntry, ...]:
    """Return an entry with the picture, room and place of each receptacle (PAPER sections 5 and 7)."""
    return tuple(BinEntry(r.label, f"{r.room}, {r.place}", r.picture) for r in view.receptacles)


def inventory(view: TaskView) -> tuple[InventorySlot | None, InventorySlot]:
    """Return the contents of the left and the right hand. With a capacity of one, the left value is None."""
    left, right = (
        InventorySlot() if name is None else InventorySlot(view.object(name).label, view.object(name).picture)
        for name in view.hands
    )
    return left if view.capacity > 1 else None, right


def random_order(view: TaskView) -> tuple[TaskObject, ...]:
    """Return the loose objects in the participant's random order, then the others in the order of picks."""
    picks = [name for kind, name in view.steps_done if kind == "pick"]
    last_pick = {name: i for i, name in enumerate(picks)}
    objects = [view.object(name) for name in view.order]
    waiting = [o for o in objects if o.status == "loose"]
    picked = sorted((o for o in objects if o.status != "loose"), key=lambda o: last_pick.get(o.name, -1))
    return (*waiting, *picked)


def random_order_rows(view: TaskView, detail: Callable[[TaskObject], str]) -> tuple[ChecklistItem, ...]:
    """Return a row for each object in the order of `random_order`. Rows of picked objects are crossed out."""
    return tuple(
        ChecklistItem(
            text=o.label,
            detail=detail(o),
            picture=o.picture,
            target_picture=view.receptacle(o.receptacle).picture,
            done=o.status != "loose",
            carried=o.status == "carried",
        )
        for o in random_order(view)
    )


def misplaced_flagpoles(view: TaskView) -> tuple[Marker, ...]:
    """Return the markers of a flagpole over every misplaced object (PAPER section 5)."""
    markers: list[Marker] = []
    for item in view.objects:
        if item.status == "loose":
            low = math.dist(item.position[:2], view.position) < NEAR
            markers += flagpole(item.position, object=item.name, low=low, x_ray=True)
    return tuple(markers)


def assemble(
    view: TaskView,
    title: str,
    checklist: tuple[ChecklistItem, ...],
    markers: tuple[Marker, ...] = (),
    pointer: Pointer | None = None,
) -> HudState:
    """Create the HUD state of a condition from its task list, markers and pointer.

    The bins, hands, message, progress and clock come from the task view and are the same in every condition.
    """
    return HudState(
        checklist_title=title,
        checklist=checklist,
        bins=bins(view),
        inventory=inventory(view),
        message=view.message,
        markers=markers,
        delivered=sum(o.status == "delivered" for o in view.objects),
        total=len(view.objects),
        clock=view.clock,
        pointer=pointer,
        scroll=view.scroll,
    )
