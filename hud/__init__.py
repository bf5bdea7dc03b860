"""The heads-up display: assistance conditions, the HUD state that they return, and its drawing.

It depends neither on the physics nor on the planner.
"""

from typing import TYPE_CHECKING

__all__ = [
    "Alternative",
    "BinEntry",
    "CameraView",
    "ChecklistItem",
    "HudError",
    "HudState",
    "HudTexts",
    "InventorySlot",
    "KnownPlan",
    "Marker",
    "Message",
    "MessageKind",
    "MiniMap",
    "PlanAhead",
    "Pointer",
    "TaskObject",
    "TaskReceptacle",
    "TaskStep",
    "TaskView",
    "assemble",
    "flagpoles",
    "from_dict",
    "json_schema",
    "pointer_to",
    "random_order_rows",
    "to_dict",
]

if TYPE_CHECKING:
    from hud.errors import HudError
    from hud.lists import assemble, random_order_rows
    from hud.markers import flagpoles
    from hud.projection import CameraView, pointer_to
    from hud.schema import from_dict, json_schema, to_dict
    from hud.state import (
        BinEntry,
        ChecklistItem,
        HudState,
        InventorySlot,
        Marker,
        Message,
        MessageKind,
        MiniMap,
        Pointer,
    )
    from hud.task import Alternative, KnownPlan, PlanAhead, TaskObject, TaskReceptacle, TaskStep, TaskView
    from hud.texts import HudTexts
else:  # hidden from type checkers, which would otherwise accept any name
    _MODULES = {
        "errors": "HudError",
        "lists": "assemble random_order_rows",
        "markers": "flagpoles",
        "projection": "CameraView pointer_to",
        "schema": "from_dict json_schema to_dict",
        "state": "BinEntry ChecklistItem HudState InventorySlot Marker Message MessageKind MiniMap Pointer",
        "task": "Alternative KnownPlan PlanAhead TaskObject TaskReceptacle TaskStep TaskView",
        "texts": "HudTexts",
    }

    def __getattr__(name):
        import importlib

        for module, names in _MODULES.items():
            if name in names.split():
                return getattr(importlib.import_module(f"hud.{module}"), name)
        raise AttributeError(f"module 'hud' has no attribute {name!r}; its public names are {__all__}")

    def __dir__():
        return sorted({*globals(), *__all__})
