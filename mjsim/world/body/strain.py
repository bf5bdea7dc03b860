"""When a load slips out of a hand: its weld is stretched, or the hand is dragged far behind its servo."""

import math

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import kernel
from mjsim.world.body.grips import site_gap

Floats = NDArray[np.float64]

MAX_SERVO_LAG = 0.25  # m; the servo saturates at 0.04 m, from there on the hand is dragged behind


@kernel
def count_strain(
    pose: Floats,
    targets: Floats,
    site_xpos: Floats,
    sites: NDArray[np.intp],
    held: tuple[bool, bool],
    max_error: float,
    patience: float,
    strained: NDArray[np.int64],
) -> int:
    """Count the control steps for which each hand's weld has been stretched by more than `max_error`, m.

    Returns the hands whose count in `strained` (2,) has reached `patience`: 1 for the left one, 2 for the right one, 3.
    """
    slipping = 0
    for hand in range(2):
        if not held[hand]:
            strained[hand] = 0
            continue
        lag = 0.0
        for axis in range(3):
            lag += (pose[4 + 3 * hand + axis] - targets[hand, axis]) ** 2
        first, second = sites[hand, 0], sites[hand, 1]
        error = site_gap(site_xpos, first, second) if first >= 0 else 0.0
        tense = error > max_error or math.sqrt(lag) > MAX_SERVO_LAG
        strained[hand] = strained[hand] + 1 if tense else 0
        if strained[hand] > patience:
            slipping += 1 << hand
    return slipping
