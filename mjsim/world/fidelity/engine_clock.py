"""Turns off MuJoCo's timers of every physics step, which would take a twentieth of a trial."""

import functools
from typing import Any

import mujoco

from mjsim.support.kernels import c_function


def stop_engine_clock() -> None:
    """Have MuJoCo's timers (`MjData.timer`) read 0 s in this process, unless a clock is set.

    `mujoco.set_mjcb_time(None)` brings MuJoCo's own clock back.
    """
    if mujoco.get_mjcb_time() is None:
        mujoco.set_mjcb_time(_no_time().ctypes)


@functools.cache
def _no_time() -> Any:
    return c_function("float64()", _zero)


def _zero() -> float:
    return 0.0
