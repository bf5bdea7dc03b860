from .errors import HudError
from .lists import assemble, random_order_rows
from .markers import flagpoles
from .projection import CameraView, pointer_to
from .schema import from_dict, json_schema, to_dict
from .state import (
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
from .task import Alternative, KnownPlan, PlanAhead, TaskObject, TaskReceptacle, TaskStep, TaskView
from .texts import HudTexts

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
