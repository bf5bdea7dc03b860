"""What conditions have in common: the list of bins, the hands, rows of objects in random order, flagpoles."""

import math
from collections.abc import Callable

from hud.markers import flagpole
from hud.state import BinEntry, ChecklistItem, HudState, InventorySlot, Marker, Pointer
from hud.task import TaskObject, TaskView

NEAR = 1.6  # m; about where an object leaves the lower edge of the view


def in_sentence(label: str) -> str:
    """A label inside a sentence: "Blue mug" to "blue mug"; "LEGO car" and "T-shirt" stay."""
    first, _, rest = label.partition(" ")
    stem = first.partition("-")[0]
    plain = len(stem) > 1 and stem.isalpha() and first[:1].isupper() and first[1:].islower()
    return f"{first.lower()} {rest}".rstrip() if plain else label


def bins(view: TaskView) -> tuple[BinEntry, ...]:
    """Every receptacle with picture, room and place in the room: all conditions show these (PAPER sections 5 and 7)."""
    return tuple(BinEntry(r.label, f"{r.room}, {r.place}", r.picture) for r in view.receptacles)


def inventory(view: TaskView) -> tuple[InventorySlot | None, InventorySlot]:
    """Contents of the left and the right hand; at a capacity of one, only the right hand carries."""
    left, right = (
        InventorySlot() if name is None else InventorySlot(view.object(name).label, view.object(name).picture)
        for name in view.hands
    )
    return left if view.capacity > 1 else None, right


def random_order(view: TaskView) -> tuple[TaskObject, ...]:
    """Objects in the participant's order; picked ones at the bottom, in the order of picking.

    An object that was dropped counts as not picked.
    """
    picks = [name for kind, name in view.steps_done if kind == "pick"]
    last_pick = {name: i for i, name in enumerate(picks)}
    objects = [view.object(name) for name in view.order]
    waiting = [o for o in objects if o.status == "loose"]
    picked = sorted((o for o in objects if o.status != "loose"), key=lambda o: last_pick.get(o.name, -1))
    return (*waiting, *picked)


def random_order_rows(view: TaskView, detail: Callable[[TaskObject], str]) -> tuple[ChecklistItem, ...]:
    """Rows of the objects in `random_order`, picked ones crossed out."""
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
    """A flagpole over every misplaced object, known through walls (PAPER section 5)."""
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
    """The HUD state of a condition: its own list and markers, and what every condition shows."""
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
