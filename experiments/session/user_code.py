"""Call custom participants, conditions and planners, and report the location of faulty code."""

import os
import signal
import threading
from collections.abc import Iterator, Mapping, Set
from contextlib import contextmanager
from types import FrameType
from typing import Any, get_args

import numpy as np

from experiments.errors import (
    CALL_LIMIT,
    PACKAGES,
    ConfigError,
    UserCodeError,
    definition,
    describe,
    shown,
    user_code_location,
)
from experiments.house import House
from experiments.participants.base import Participant, Percept
from experiments.participants.registry import participant
from experiments.session.signals import exit_raised
from hud.conditions import Condition
from hud.errors import SchemaError
from hud.schema import check_state
from hud.state import HudState
from hud.task import TaskView
from mjsim.values.actions import Action
from mjsim.values.errors import PhysicsError, RenderError
from planner.errors import UnreachableError

MAX_CALL_LIMIT = 1e6  # largest time limit for a call that is supported, in seconds
PASSED_ON = (KeyboardInterrupt, UserCodeError, UnreachableError, PhysicsError, RenderError)


class _Overdue(BaseException):
    """Raised if a call exceeds its time limit. It is not an `Exception`, so user code does not catch it."""


@contextmanager
def user_code(code: object, what: str) -> Iterator[None]:
    """Convert exceptions in the block, including `SystemExit`, to `UserCodeError`, and limit its duration.

    The block is not affected if the function or object `code` belongs to mjsim. `what` names it in messages.
    """
    if not is_own(code):
        yield
        return
    limit = _call_limit()
    try:
        with _time_limit(limit), exit_raised():
            yield
    except PASSED_ON:
        raise
    except _Overdue as error:
        raise UserCodeError(f"{what} {error}; --call-limit allows more{user_code_location(error)}") from error
    except BaseException as error:  # user code must not end the process and lose the run
        raise UserCodeError(f"{what} raised {describe(error)}{user_code_location(error)}") from error


def _call_limit() -> float:
    text = os.environ.get(CALL_LIMIT) or "0"
    try:
        return min(abs(float(text)), MAX_CALL_LIMIT)
    except ValueError:
        raise ConfigError(f"{CALL_LIMIT} is {text!r}; give a number of seconds") from None


@contextmanager
def _time_limit(limit: float) -> Iterator[None]:
    if not limit or threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(_number: int, _frame: FrameType | None) -> None:
        raise _Overdue(f"did not answer within {limit:g} s")

    handler = signal.signal(signal.SIGALRM, interrupt)
    before = signal.setitimer(signal.ITIMER_REAL, limit)
    try:
        yield
    finally:
        if signal.getsignal(signal.SIGALRM) is interrupt:
            signal.setitimer(signal.ITIMER_REAL, *before)
            signal.signal(signal.SIGALRM, handler)


def is_own(code: object) -> bool:
    """Return True if a function or object is user code."""
    return str(getattr(code, "__module__", None) or "").partition(".")[0] not in PACKAGES


def make_participant(
    name: str, house: House, rng: np.random.Generator, behaviour: Mapping[str, float] | None = None
) -> Participant:
    """Create a participant for a house. `behaviour` contains parameters of the participant model.

    Raises ConfigError if the participant does not exist, and UserCodeError if a custom participant is faulty.
    """
    make = participant(name)
    with user_code(make, f"participant {name!r}"):
        made = make(house, rng, behaviour) if behaviour else make(house, rng)  # type: ignore[call-arg]
    with user_code(made, f"participant {name!r}"):
        acts = callable(getattr(made, "act", None))
    if not acts:
        raise UserCodeError(f"participant {name!r} is {shown(made)}, which has no method act(percept)")
    needs_of(made)
    return made


def needs_of(participant: Participant) -> frozenset[str]:
    """Return the roles of the markers that a participant requires.

    Raises UserCodeError if they are not a set of names.
    """
    name = f"participant {type(participant).__qualname__}"
    with user_code(participant, name):
        needs: Any = getattr(participant, "needs", frozenset())
    if not isinstance(needs, Set) or not all(isinstance(role, str) for role in needs):
        raise UserCodeError(
            f'{name} needs {shown(needs)}; it must be a set of marker roles, such as frozenset({{"flagpole"}})'
        )
    return frozenset(needs)


def decide(participant: Participant, percept: Percept) -> Action:
    """Return the action that a participant chooses.

    Raises UserCodeError if a custom participant failed or returned another type.
    """
    name = type(participant).__qualname__
    with user_code(participant, f"participant {name}"):
        decision = participant.act(percept)
    if not isinstance(decision, Action):
        kinds = ", ".join(kind.__name__ for kind in get_args(Action))
        raise UserCodeError(
            f"participant {name} answered {shown(decision)} at {percept.time:.2f} s; act returns one of {kinds}"
            f"{definition(participant.act)}"
        )
    return decision


def shown_by(condition: Condition, name: str, view: TaskView) -> HudState:
    """Return the HUD state that a condition creates from the view of the task.

    Raises UserCodeError if a custom condition failed or returned another type.
    """
    with user_code(condition, f"assistance condition {name!r}"):
        state = condition(view)
    if is_own(condition) or not isinstance(state, HudState):
        try:
            check_state(state)
        except SchemaError as error:
            raise UserCodeError(
                f"assistance condition {name!r} returned {error}{definition(condition)}"
            ) from error
    return state
