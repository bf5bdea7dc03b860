"""A detector of objects that may hit something fast, for which physics steps are shortened.

In one physics step of 4 ms, an object that has fallen from a hand moves by 2 cm, so it would sink that far into the
floor before MuJoCo detects a contact. The same holds for a load that swings around a hand towards furniture, and for
two loads that meet.
"""

import math
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.footprint import ClearanceField, clearance_at
from mjsim.house.scene.scene import Scene
from mjsim.support.kernels import kernel

MAX_SPEED = 1.0  # downward speed of a part of an object above which the object is falling, in m/s
# Speed at which a carried object may hit furniture in a physics step of full length, in m/s
MAX_APPROACH = 1.0
# Speed at which two carried objects may hit each other in a physics step of full length, in m/s. Two hands press them
# together, so that they overlap more.
MAX_MEETING = 0.4
# Distance by which objects may come closer than expected in a control step, in metres
MARGIN = 0.03
Floats = NDArray[np.float64]


class ImpactDetector:
    """A detector of falling or tumbling objects, and of carried objects that may hit something fast."""

    def __init__(self, scene: Scene, data: mujoco.MjData, clearance: ClearanceField, dt: float) -> None:
        model, index = scene.model, scene.index
        geoms = np.flatnonzero((index.geom_owner >= 0) & ((model.geom_contype | model.geom_conaffinity) > 0))
        radii = np.zeros(len(index.names))  # largest distance of a part from the origin of its body
        extents = np.linalg.norm(model.geom_pos[geoms], axis=1) + model.geom_rbound[geoms]
        np.maximum.at(radii, index.geom_owner[geoms], extents)
        self._arrays = (data.qvel, data.xpos, data.xmat, index.dofs, index.bodies, radii)
        self._surroundings = (tuple(clearance), dt)

    def detects(self, gripped: tuple[int, ...]) -> bool:
        """Return True if a loose object falls fast, or if one that is `gripped` may soon hit furniture or the other."""
        first, second = (*gripped, -1, -1)[:2]
        return bool(_detects(self._arrays, self._surroundings, first, second))


@kernel
def _detects(arrays: Any, surroundings: Any, first: int, second: int) -> bool:
    qvel, xpos, xmat, dofs, bodies, radii = arrays
    if first >= 0 and second >= 0 and _meet(arrays, first, second, surroundings[1]):
        return True
    for item in range(len(dofs)):
        dof = dofs[item]
        if item in (first, second):
            if _approaches(xpos[bodies[item]], qvel[dof : dof + 2], radii[item], surroundings):
                return True
            continue
        square = upright = 0.0
        for axis in range(3):  # of the body's frame, in which the third row of `xmat` points up
            rate = qvel[dof + 3 + axis]
            square += rate * rate
            upright += rate * xmat[bodies[item], 6 + axis]
        tumbling = math.sqrt(max(0.0, square - upright * upright))
        if tumbling * radii[item] - qvel[dof + 2] > MAX_SPEED:
            return True
    return False


@kernel
def _approaches(position: Floats, velocity: Floats, radius: float, surroundings: Any) -> bool:
    """Return True if an object moves fast towards furniture that it can reach within the next control step."""
    clearance, dt = surroundings
    room, away_x, away_y = clearance_at(position[0], position[1], ClearanceField(*clearance))
    approach = -(velocity[0] * away_x + velocity[1] * away_y)
    return bool(approach > MAX_APPROACH and room - radius < approach * dt + MARGIN)


@kernel
def _meet(arrays: Any, first: int, second: int, dt: float) -> bool:
    """Return True if two objects may hit each other fast within the next control step."""
    qvel, xpos, _, dofs, bodies, radii = arrays
    distance = speed = 0.0
    for axis in range(3):
        distance += (xpos[bodies[first], axis] - xpos[bodies[second], axis]) ** 2
        speed += (qvel[dofs[first] + axis] - qvel[dofs[second] + axis]) ** 2
    speed = math.sqrt(speed)
    gap = math.sqrt(distance) - radii[first] - radii[second]
    return bool(speed > MAX_MEETING and gap < speed * dt + MARGIN)
