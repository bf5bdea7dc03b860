"""Building blocks of conditions: rows of objects in random order, flagpoles, and the panels of every condition."""

import math
from collections.abc import Callable

from hud.markers import flagpole
from hud.state import BinEntry, ChecklistItem, HudState, InventorySlot, Marker, Pointer
from hud.task import TaskObject, TaskView

NEAR = 1.6  # distance at which an object is about to leave the view at the bottom, m


def in_sentence(label: str) -> str:
    """Return a label as it reads in a sentence: "Blue mug" becomes "blue mug", but "LEGO car" and "T-shirt" stay."""
    first, _, rest = label.partition(" ")
    stem = first.partition("-")[0]
    plain = len(stem) > 1 and stem.isalpha() and first[:1].isupper() and first[1:].islower()
    return f"{first.lower()} {rest}".rstrip() if plain else label


def bins(view: TaskView) -> tuple[BinEntry, ...]:
    """List all receptacles with picture, room and place in the room (PAPER sections 5 and 7)."""
    return tuple(BinEntry(r.label, f"{r.room}, {r.place}", r.picture) for r in view.receptacles)


def inventory(view: TaskView) -> tuple[InventorySlot | None, InventorySlot]:
    """Return the contents of the left and the right hand. With a capacity of one, only the right hand carries."""
    left, right = (
        InventorySlot() if name is None else InventorySlot(view.object(name).label, view.object(name).picture)
        for name in view.hands
    )
    return left if view.capacity > 1 else None, right


def random_order(view: TaskView) -> tuple[TaskObject, ...]:
    """Return the objects in the participant's random order, followed by the picked ones in the order of their picks.

    A dropped object does not count as picked.
    """
    picks = [name for kind, name in view.steps_done if kind == "pick"]
    last_pick = {name: i for i, name in enumerate(picks)}
    objects = [view.object(name) for name in view.order]
    waiting = [o for o in objects if o.status == "loose"]
    picked = sorted((o for o in objects if o.status != "loose"), key=lambda o: last_pick.get(o.name, -1))
    return (*waiting, *picked)


def random_order_rows(view: TaskView, detail: Callable[[TaskObject], str]) -> tuple[ChecklistItem, ...]:
    """Make a row for each object, in the order of `random_order`. Rows of picked objects are crossed out."""
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
    """Make a flagpole, visible through walls, over every misplaced object (PAPER section 5)."""
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
    """Make the HUD state of a condition from its task list, markers and pointer.

    The bins, hands, message, progress and clock are those of the task view, as in every condition.
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
