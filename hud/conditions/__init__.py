"""Assistance conditions: what each shows. Every module here is one, named after its file.

A condition is a function from a task view to a HUD state. To add one, add a file with a function `hud_state`;
to use one from elsewhere, name it `package.module:attribute`. Options follow a condition's name after hyphens.
"""

import functools
import importlib
import pkgutil
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias, cast

from hud.errors import ConditionError
from hud.options import option, option_names

if TYPE_CHECKING:  # options of commands name conditions, and must not load NumPy
    from hud.state import HudState
    from hud.task import TaskView

Condition: TypeAlias = "Callable[[TaskView], HudState]"
ATTRIBUTE = "hud_state"


def condition_names() -> tuple[str, ...]:
    """Names of the conditions in this package, sorted."""
    return tuple(sorted(m.name for m in pkgutil.iter_modules(__path__) if not m.name.startswith("_")))


def condition(name: str) -> Condition:
    """The condition called `name`: a file of this package, or `package.module:attribute`; `-option` may follow."""
    base, *asked = name.split("-")
    show, options = _plain_condition(base), [option(o) for o in asked]
    if len(set(asked)) != len(asked):
        raise ConditionError(f"condition {name!r} names an option twice; give each once")

    @functools.wraps(show)
    def hud_state(view: "TaskView") -> "HudState":
        return functools.reduce(lambda state, apply: apply(view, state), options, show(view))

    return hud_state if options else show


def _plain_condition(name: str) -> Condition:
    if name in condition_names():
        return cast("Condition", getattr(importlib.import_module(f"{__name__}.{name}"), ATTRIBUTE))
    if ":" not in name:
        raise ConditionError(f"no assistance condition {name!r}; available: {_available()}")
    try:
        found = pkgutil.resolve_name(name)
    except (Exception, SystemExit) as error:  # whatever the module does when it is imported
        raise ConditionError(
            f"cannot load condition {name!r} ({type(error).__name__}: {error}); modules are looked for in the current "
            f"folder and among those installed; available: {_available()}"
        ) from error
    if not callable(found):
        raise ConditionError(f"condition {name!r} is a {type(found).__name__}, not a function of a task view")
    return cast("Condition", found)


def _available() -> str:
    options = " or ".join(f"-{name}" for name in option_names())
    return f"{', '.join(condition_names())}, or package.module:attribute, each also with {options}"
