"""One pass over the state, the objects, the hands and the contacts after a control step, as a numba kernel."""

import math
from typing import Any

from mjsim.kernels import kernel
from mjsim.model.clearance import way_is_clear
from mjsim.model.rooms import nearest_rectangle
from mjsim.person.grips import site_angle, site_gap

OUTSIDE = 0.3  # m; rooms end at their walls, and doorways lie in between

# What a survey finds.
WELL, ESCAPING, WARNED, NOT_FINITE = 0, 1, 2, 3
# Marks of an object: farther than a distance from where it was last looked at, faster than a speed, slower than
# another, and touched by the person's foot.
MOVED, FAST, SLOW, PUSHED = 1, 2, 4, 8


@kernel
def survey(
    qpos: Any, qvel: Any, xipos: Any, site_xpos: Any, site_xmat: Any, geoms: Any, dists: Any, warnings: Any,
    bodies: Any, dofs: Any, owner: Any, trunk: int, foot: int, limits: Any, pairs: Any, left: bool, right: bool,
    field: Any, rooms: Any, anchors: Any, marks: Any, sample: Any,
) -> int:  # fmt: skip
    """Look at the state, all objects, both hands and all contacts once.

    Args:
        qpos: Positions.
        qvel: Velocities.
        xipos: Centres of mass of all bodies, m, (nbody, 3).
        site_xpos: Positions of all sites, m, (nsite, 3).
        site_xmat: Their frames, (nsite, 9).
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
        pairs: `Grips.pairs`.
        left: Whether the left hand carries something.
        right: Whether the right one does.
        field: Arrays of `carry_clearance`.
        rooms: `RoomMap.rectangles`.
        anchors: Where each object was last looked at, m, (n, 3); moved along where the way is clear by `field`.
        marks: Marks of each object, (n,); overwritten.
        sample: The deepest overlap of an object with anything but the person, and that of the trunk with the house,
            both in m and not negative; how far the weld of either hand is stretched, m, and twisted, rad, NaN for a
            hand that carries nothing; (6,), overwritten.

    Returns:
        `WELL`, `ESCAPING` if any object has to be looked at or is fast, `WARNED` or `NOT_FINITE`.
    """
    for count in warnings:
        if count:
            return WARNED
    total = 0.0
    for value in qpos:
        total += value
    for value in qvel:
        total += value
    if not math.isfinite(total):
        return NOT_FINITE
    state = _mark_objects(qvel, xipos, bodies, dofs, limits, field, rooms, anchors, marks)
    sample[0], sample[1] = _overlaps(geoms, dists, owner, trunk, foot, marks)
    for hand in range(2):
        sample[2 + hand] = sample[4 + hand] = math.nan
        if (left if hand == 0 else right) and pairs[hand, 0] >= 0:
            sample[2 + hand] = site_gap(site_xpos, pairs[hand, 0], pairs[hand, 1])
            sample[4 + hand] = site_angle(site_xmat, pairs[hand, 0], pairs[hand, 1])
    return state


@kernel
def _mark_objects(
    qvel: Any, xipos: Any, bodies: Any, dofs: Any, limits: Any, field: Any, rooms: Any, anchors: Any, marks: Any
) -> int:  # fmt: skip
    state = WELL
    for item in range(len(bodies)):
        body, dof, mark = bodies[item], dofs[item], 0
        gap = speed = 0.0
        for k in range(3):
            gap += (xipos[body, k] - anchors[item, k]) ** 2
            speed += qvel[dof + k] ** 2
        if gap > limits[0]:
            at = xipos[body]
            clear = way_is_clear(anchors[item], at, field[0], field[1], field[2])
            if clear and nearest_rectangle(at[0], at[1], rooms[0], rooms[1], rooms[2]) <= OUTSIDE:
                anchors[item, 0], anchors[item, 1], anchors[item, 2] = at[0], at[1], at[2]
            else:
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
