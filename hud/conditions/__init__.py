"""Assistance conditions: what each shows. Every module here is one, named after its file.

A condition is a function from a task view to a HUD state. To add one, add a file with a function `hud_state`;
to use one from elsewhere, name it `package.module:attribute`. Options follow a condition's name after hyphens.
"""

import functools
import importlib
import pkgutil
from collections.abc import Callable

from hud.errors import ConditionError
from hud.options import option, option_names
from hud.state import HudState
from hud.task import TaskView

Condition = Callable[[TaskView], HudState]
ATTRIBUTE = "hud_state"


def condition_names() -> tuple[str, ...]:
    """Names of the conditions in this package, sorted."""
    return tuple(sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_")))


def condition(name: str) -> Condition:
    """The condition called `name`: a file of this package, or `package.module:attribute`; `-option` may follow.

    Raises:
        ConditionError: There is no condition or option of that name, or it cannot be called.
    """
    base, *asked = name.split("-")
    show, options = _plain_condition(base), [option(o) for o in asked]

    def hud_state(view: TaskView) -> HudState:
        return functools.reduce(lambda state, apply: apply(view, state), options, show(view))

    return hud_state if options else show


def _plain_condition(name: str) -> Condition:
    module_name, _, attribute = name.partition(":")
    if not attribute:
        if name not in condition_names():
            raise ConditionError(f"no assistance condition {name!r}; available: {_available()}")
        module_name, attribute = f"{__name__}.{name}", ATTRIBUTE
    try:
        found: Condition = getattr(importlib.import_module(module_name), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise ConditionError(
            f"cannot load condition {name!r} ({error}); available: {_available()}"
        ) from error
    if not callable(found):
        raise ConditionError(f"condition {name!r} is a {type(found).__name__}, not a function of a task view")
    return found


def _available() -> str:
    options = " or ".join(f"-{name}" for name in option_names())
    return f"{', '.join(condition_names())}, or package.module:attribute, each also with {options}"
