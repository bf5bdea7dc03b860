"""Calling code that is not ours: participants, conditions and planners that users plug in."""

from collections.abc import Iterator, Mapping, Set
from contextlib import contextmanager
from typing import Any

import numpy as np

from experiments.errors import ExperimentError, UserCodeError
from experiments.house import House
from experiments.participants import participant
from experiments.participants.base import DECISIONS, Decision, Participant, Percept
from hud.conditions import Condition
from hud.errors import HudError
from hud.state import HudState
from hud.task import TaskView
from mjsim.errors import MjsimError
from planner.errors import PlannerError

OUR_ERRORS = (ExperimentError, HudError, MjsimError, PlannerError)
PACKAGES = ("experiments", "hud", "mjsim", "planner")


@contextmanager
def user_code(code: object, what: str) -> Iterator[None]:
    """Turn whatever `code` raises into an error that says whose it is; leave ours as they are.

    Args:
        code: A function, or an object with methods.
        what: Names it in the message.

    Raises:
        UserCodeError: `code` is no part of this project, and raised something that is no typed error of ours.
    """
    try:
        yield
    except OUR_ERRORS:
        raise
    except (Exception, SystemExit) as error:  # somebody's code must not end the process and lose the run
        if _is_ours(code):
            raise
        raise UserCodeError(f"{what} raised {describe(error)}{_place(error)}") from error


def describe(error: BaseException) -> str:
    """An error as one line: what it says, with its type where it is none of ours."""
    said = " ".join(str(error).split())
    if isinstance(error, OUR_ERRORS):
        return said
    return f"{type(error).__name__}: {said}" if said else type(error).__name__


def _is_ours(code: object) -> bool:
    module = getattr(code, "__module__", None) or ""
    return module.partition(".")[0] in PACKAGES


def _place(error: BaseException) -> str:
    """Where it was raised, or came out of somebody else's code."""
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
        UserCodeError: It is one of somebody's own that cannot be made, or what is made is no participant.
    """
    make = participant(name)
    with user_code(make, f"participant {name!r}"):
        made = make(house, rng, behaviour) if behaviour else make(house, rng)  # type: ignore[call-arg]
    if not callable(getattr(made, "act", None)):
        raise UserCodeError(f"participant {name!r} is {made!r}, which has no method act(percept)")
    needs_of(made)
    return made


def needs_of(participant: Participant) -> frozenset[str]:
    """Roles of the markers that a participant cannot do without; one that says nothing needs none.

    Raises:
        UserCodeError: What it says is no set of names.
    """
    needs: Any = getattr(participant, "needs", frozenset())
    if not isinstance(needs, Set) or not all(isinstance(role, str) for role in needs):
        raise UserCodeError(
            f"participant {type(participant).__qualname__} needs {needs!r}; "
            'it must be a set of marker roles, such as frozenset({"flagpole"})'
        )
    return frozenset(needs)


def decide(participant: Participant, percept: Percept) -> Decision:
    """What a participant answers.

    Raises:
        UserCodeError: It is a participant of somebody's own that failed, or the answer is no decision.
    """
    name = type(participant).__qualname__
    with user_code(participant, f"participant {name}"):
        decision = participant.act(percept)
    if not isinstance(decision, DECISIONS):
        kinds = ", ".join(kind.__name__ for kind in DECISIONS)
        raise UserCodeError(
            f"participant {name} answered {decision!r} at {percept.time:.2f} s; act returns one of {kinds}"
        )
    return decision


def shown_by(condition: Condition, name: str, view: TaskView) -> HudState:
    """What an assistance condition shows.

    Raises:
        UserCodeError: It is a condition of somebody's own that failed, or the answer is no HUD state.
    """
    with user_code(condition, f"assistance condition {name!r}"):
        state = condition(view)
    if not isinstance(state, HudState):
        raise UserCodeError(f"assistance condition {name!r} returned {state!r}; it must return a HudState")
    return state
