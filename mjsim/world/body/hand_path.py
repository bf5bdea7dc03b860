"""Point-to-point movements of a hand: smooth in time, and either straight or with height leading or following."""

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import kernel

STRAIGHT, ACROSS_FIRST, UP_FIRST = 0, 1, 2  # orders of a movement's two parts, horizontal and vertical


@kernel
def minimum_jerk(phase: float) -> float:
    """Progress 0..1 of the smoothest point-to-point movement at a phase (Flash and Hogan, 1985), clamped."""
    s = min(1.0, max(0.0, phase))
    return s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)


@kernel
def progress(phase: float, order: int, lead: float) -> tuple[float, float]:
    """Horizontal and vertical progress 0..1 at a phase 0..1 of a movement; `lead` is the share of it that one leads."""
    if order == STRAIGHT:
        share = minimum_jerk(phase)
        return share, share
    early, late = minimum_jerk(phase / (1.0 - lead)), minimum_jerk((phase - lead) / (1.0 - lead))
    return (early, late) if order == ACROSS_FIRST else (late, early)


@kernel
def point_between(
    start: NDArray[np.float64], goal: NDArray[np.float64], phase: float, order: int, lead: float
) -> NDArray[np.float64]:
    """Where a hand is at a phase 0..1 of its movement from `start` to `goal`, m, all of shape (3,)."""
    across, up = progress(phase, order, lead)
    point = np.empty(3)
    for axis in range(3):
        point[axis] = start[axis] + (across if axis < 2 else up) * (goal[axis] - start[axis])
    return point
