"""Calls user-supplied participants, conditions and planners, and names the culprit of an error."""

from collections.abc import Iterator, Mapping, Set
from contextlib import contextmanager
from typing import Any, get_args

import numpy as np

from experiments.errors import ExperimentError, UserCodeError
from experiments.house import House
from experiments.participants import participant
from experiments.participants.base import Participant, Percept
from hud.conditions import Condition
from hud.errors import HudError
from hud.state import HudState
from hud.task import TaskView
from mjsim.actions import Action
from mjsim.errors import MjsimError
from planner.errors import PlannerError

OUR_ERRORS = (ExperimentError, HudError, MjsimError, PlannerError)
PACKAGES = ("experiments", "hud", "mjsim", "planner")


@contextmanager
def user_code(code: object, what: str) -> Iterator[None]:
    """Wrap exceptions of user-supplied `code` in a `UserCodeError`; errors of this project pass through.

    Args:
        code: A function, or an object with methods.
        what: Names it in the message.

    Raises:
        UserCodeError: `code` is not part of this project and raised something other than this project's errors.
    """
    try:
        yield
    except OUR_ERRORS:
        raise
    except (Exception, SystemExit) as error:  # user code must not end the process and lose the run
        if _is_of_this_project(code):
            raise
        raise UserCodeError(f"{what} raised {describe(error)}{_place(error)}") from error


def describe(error: BaseException) -> str:
    """An error as one line: its message, preceded by its type unless it is one of this project's errors."""
    message = " ".join(str(error).split())
    if isinstance(error, OUR_ERRORS):
        return message
    return f"{type(error).__name__}: {message}" if message else type(error).__name__


def _is_of_this_project(code: object) -> bool:
    module = getattr(code, "__module__", None) or ""
    return module.partition(".")[0] in PACKAGES


def _place(error: BaseException) -> str:
    """File and line of the innermost frame outside this project."""
    trace, found = error.__traceback__, ""
    while trace is not None:
        code, module = trace.tb_frame.f_code, str(trace.tb_frame.f_globals.get("__name__", ""))
        if module.partition(".")[0] not in PACKAGES:
            found = f" ({code.co_filename}, line {trace.tb_lineno})"
        trace = trace.tb_next
    return found


def make_participant(
    name: str, house: House, rng: np.random.Generator, behaviour: Mapping[str, float] | None = None
) -> Participant:
    """The participant called `name`, made for a house, with the values of its model if that has any.

    Raises:
        ConfigError: There is no such participant.
        UserCodeError: A user-supplied participant cannot be created, or has no method `act`.
    """
    make = participant(name)
    with user_code(make, f"participant {name!r}"):
        made = make(house, rng, behaviour) if behaviour else make(house, rng)  # type: ignore[call-arg]
    if not callable(getattr(made, "act", None)):
        raise UserCodeError(f"participant {name!r} is {made!r}, which has no method act(percept)")
    needs_of(made)
    return made


def needs_of(participant: Participant) -> frozenset[str]:
    """Roles of the markers that a participant requires; none by default.

    Raises:
        UserCodeError: `needs` is not a set of names.
    """
    needs: Any = getattr(participant, "needs", frozenset())
    if not isinstance(needs, Set) or not all(isinstance(role, str) for role in needs):
        raise UserCodeError(
            f"participant {type(participant).__qualname__} needs {needs!r}; "
            'it must be a set of marker roles, such as frozenset({"flagpole"})'
        )
    return frozenset(needs)


def decide(participant: Participant, percept: Percept) -> Action:
    """The decision of a participant.

    Raises:
        UserCodeError: A user-supplied participant failed, or returned something other than a decision.
    """
    name = type(participant).__qualname__
    with user_code(participant, f"participant {name}"):
        decision = participant.act(percept)
    if not isinstance(decision, Action):
        kinds = ", ".join(kind.__name__ for kind in get_args(Action))
        raise UserCodeError(
            f"participant {name} answered {decision!r} at {percept.time:.2f} s; act returns one of {kinds}"
        )
    return decision


def shown_by(condition: Condition, name: str, view: TaskView) -> HudState:
    """The HUD state of an assistance condition.

    Raises:
        UserCodeError: A user-supplied condition failed, or returned something other than a `HudState`.
    """
    with user_code(condition, f"assistance condition {name!r}"):
        state = condition(view)
    if not isinstance(state, HudState):
        raise UserCodeError(f"assistance condition {name!r} returned {state!r}; it must return a HudState")
    return state
