"""One pass over the state, the objects and the contacts after a control step, as a numba kernel."""

import math
from typing import Any

from mjsim.kernels import kernel

# What a survey finds.
WELL, ESCAPING, WARNED, NOT_FINITE = 0, 1, 2, 3
# Marks of an object: farther than a distance from where it was last looked at, faster than a speed, slower than
# another, and touched by the person's foot.
MOVED, FAST, SLOW, PUSHED = 1, 2, 4, 8


@kernel
def survey(
    qpos: Any, qvel: Any, xipos: Any, geoms: Any, dists: Any, warnings: Any, bodies: Any, dofs: Any, owner: Any,
    trunk: int, foot: int, limits: Any, anchors: Any, marks: Any,
) -> tuple[int, float, float]:  # fmt: skip
    """Look at the state, all objects and all contacts once.

    Args:
        qpos: Positions.
        qvel: Velocities.
        xipos: Centres of mass of all bodies, m, (nbody, 3).
        geoms: Geoms of each contact, (ncon, 2).
        dists: Distance of each contact, m, negative where geoms overlap, (ncon,).
        warnings: How often MuJoCo has warned, by kind.
        bodies: Body of each object, (n,).
        dofs: First degree of freedom of each object, (n,).
        owner: Object of each geom, or -1, (ngeom,).
        trunk: The person's trunk, a geom.
        foot: The person's foot, a geom.
        limits: Squares of the distance, m, beyond which an object counts as `MOVED`, of the speed, m/s, beyond which
            it is `FAST`, and of the speed below which it is `SLOW`, (3,).
        anchors: Where each object was last looked at, m, (n, 3).
        marks: Marks of each object, (n,); overwritten.

    Returns:
        `WELL`, `ESCAPING` if any object has moved or is fast, `WARNED` or `NOT_FINITE`; the deepest overlap of an
        object with anything but the person, and that of the trunk with the house, both in m and not negative.
    """
    for count in warnings:
        if count:
            return WARNED, 0.0, 0.0
    total = 0.0
    for value in qpos:
        total += value
    for value in qvel:
        total += value
    if not math.isfinite(total):
        return NOT_FINITE, 0.0, 0.0
    state = _mark_objects(qvel, xipos, bodies, dofs, limits, anchors, marks)
    deepest, deepest_trunk = _overlaps(geoms, dists, owner, trunk, foot, marks)
    return state, deepest, deepest_trunk


@kernel
def _mark_objects(
    qvel: Any, xipos: Any, bodies: Any, dofs: Any, limits: Any, anchors: Any, marks: Any
) -> int:
    state = WELL
    for item in range(len(bodies)):
        body, dof, mark = bodies[item], dofs[item], 0
        gap = speed = 0.0
        for k in range(3):
            gap += (xipos[body, k] - anchors[item, k]) ** 2
            speed += qvel[dof + k] ** 2
        if gap > limits[0]:
            mark |= MOVED
        if speed > limits[1]:
            mark |= FAST
        if mark:
            state = ESCAPING
        if speed < limits[2]:
            mark |= SLOW
        marks[item] = mark
    return state


@kernel
def _overlaps(geoms: Any, dists: Any, owner: Any, trunk: int, foot: int, marks: Any) -> tuple[float, float]:
    deepest = deepest_trunk = 0.0
    for c in range(len(dists)):
        first, second = geoms[c, 0], geoms[c, 1]
        if first == trunk or second == trunk:
            deepest_trunk = max(deepest_trunk, -dists[c])
        elif first == foot or second == foot:
            item = owner[second] if first == foot else owner[first]
            if item >= 0 and dists[c] < 0.0:
                marks[item] |= PUSHED
        else:
            deepest = max(deepest, -dists[c])
    return deepest, deepest_trunk
