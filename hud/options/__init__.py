"""Options of assistance conditions. Every module here is one, named after its file.

An option is a function from a task view and the HUD state of the condition to another HUD state. Options follow the
condition's name, `optimal-xray-minimap`, and apply in that order.
"""

import importlib
import pkgutil
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

from hud.errors import ConditionError

if TYPE_CHECKING:  # options of commands name these, and must not load NumPy
    from hud.state import HudState
    from hud.task import TaskView

Option: TypeAlias = "Callable[[TaskView, HudState], HudState]"
ATTRIBUTE = "apply"


def option_names() -> tuple[str, ...]:
    """Names of the options in this package, sorted."""
    return tuple(sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_")))


def option(name: str) -> Option:
    """The option called `name`; a ConditionError where there is none."""
    if name not in option_names():
        raise ConditionError(f"no option {name!r} of conditions; available: {', '.join(option_names())}")
    found: Option = getattr(importlib.import_module(f"{__name__}.{name}"), ATTRIBUTE)
    return found
