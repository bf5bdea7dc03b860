"""The registry of assistance conditions and their options."""

import functools
import pkgutil
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias, cast

from hud.errors import ConditionError

if TYPE_CHECKING:  # the command line imports this module and must not load NumPy
    from hud.state import HudState
    from hud.task import TaskView

Condition: TypeAlias = "Callable[[TaskView], HudState]"
Option: TypeAlias = "Callable[[TaskView, HudState], HudState]"

# Names of functions in `hud.builtin_conditions` and `hud.builtin_options`.
CONDITIONS = ("guided", "highlight", "none", "optimal")
OPTIONS = ("bins", "minimap", "pin", "pointer", "regret", "reroute", "rims", "xray")


def hides_plan(name: str) -> bool:
    """Return True if a condition is known to show nothing of the plan."""
    base, *options = name.split("-")
    return base in ("highlight", "none") and not {"pin", "pointer", "regret"} & set(options)


def condition(name: str) -> Condition:
    """Return a condition by its name, such as `optimal`, `optimal-minimap` or `package.module:attribute`.

    Raises:
        ConditionError: There is no such condition or option, or it cannot be loaded.
    """
    base, *asked = name.split("-")
    show, options = _without_options(base), [_option(o) for o in asked]
    if len(set(asked)) != len(asked):
        raise ConditionError(f"condition {name!r} names an option twice; give each once")

    @functools.wraps(show)
    def hud_state(view: "TaskView") -> "HudState":
        return functools.reduce(lambda state, apply: apply(view, state), options, show(view))

    return hud_state if options else show


def _option(name: str) -> Option:
    if name not in OPTIONS:
        raise ConditionError(f"no option {name!r} of conditions; available: {', '.join(OPTIONS)}")
    from hud import builtin_options

    return cast("Option", getattr(builtin_options, name))


def _without_options(name: str) -> Condition:
    if name in CONDITIONS:
        from hud import builtin_conditions

        return cast("Condition", getattr(builtin_conditions, name))
    if ":" not in name:
        raise ConditionError(f"no assistance condition {name!r}; available: {_available()}")
    try:
        found = pkgutil.resolve_name(name)
    except (Exception, SystemExit) as error:  # user code may raise any exception on import
        raise ConditionError(
            f"cannot load condition {name!r} ({type(error).__name__}: {error}); modules are searched for in the "
            f"current folder and among those installed; available: {_available()}"
        ) from error
    if not callable(found):
        raise ConditionError(f"condition {name!r} is a {type(found).__name__}, not a function of a task view")
    return cast("Condition", found)


def _available() -> str:
    options = " or ".join(f"-{name}" for name in OPTIONS)
    return f"{', '.join(CONDITIONS)}, or package.module:attribute, each also with {options}"
