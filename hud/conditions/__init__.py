"""Assistance conditions: what each shows. Every module here is one, named after its file.

A condition is a function from a task view to a HUD state. To add one, add a file with a function `hud_state`;
to use one from elsewhere, name it `package.module:attribute`.
"""

import importlib
import pkgutil
from collections.abc import Callable

from hud.errors import ConditionError
from hud.state import HudState
from hud.task import TaskView

Condition = Callable[[TaskView], HudState]
ATTRIBUTE = "hud_state"


def condition_names() -> tuple[str, ...]:
    """Names of the conditions in this package, sorted."""
    return tuple(sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_")))


def condition(name: str) -> Condition:
    """The condition called `name`: a file of this package, or `package.module:attribute`.

    Raises:
        ConditionError: There is none of that name, or it cannot be called.
    """
    module_name, _, attribute = name.partition(":")
    if not attribute:
        if name not in condition_names():
            raise ConditionError(
                f"no assistance condition {name!r}; available: {', '.join(condition_names())}, "
                "or package.module:attribute"
            )
        module_name, attribute = f"{__name__}.{name}", ATTRIBUTE
    try:
        found: Condition = getattr(importlib.import_module(module_name), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise ConditionError(
            f"cannot load condition {name!r} ({error}); available: {', '.join(condition_names())}, "
            "or package.module:attribute"
        ) from error
    if not callable(found):
        raise ConditionError(f"condition {name!r} is a {type(found).__name__}, not a function of a task view")
    return found
