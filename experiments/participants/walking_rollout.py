"""Control steps of an errand, as kernels: one at a time, or a whole walk foreseen."""

import numpy as np
from numpy.typing import NDArray

from experiments.participants.walking import (
    distance,
    follow,
    path_length,
    project,
    rest_of,
    turn_towards,
)
from mjsim.fidelity.body_state import HEADING, X, Y
from mjsim.fidelity.kinematics import Gait
from mjsim.fidelity.kinematics import walk as walk_body
from mjsim.fidelity.trunk_contact import Floor
from mjsim.kernels import kernel

ARRIVED = 0.06  # m from the end of the way
FACING = 0.25  # rad
STUCK_AFTER = 2.0  # s without headway
TICK = 1e-6  # s; times are sums of many steps, and no decision shall hang on their rounding

WALK, TURN, ACT = 0, 1, 2  # what to do in a control step
LEAST_LEFT, SINCE = 0, 1  # memory of a walk: the shortest way left so far, m, and when that was, s


@kernel
def headway(way: NDArray[np.float64], x: float, y: float, time: float, memory: NDArray[np.float64]) -> bool:
    """Whether a walk along `way` gets on; writes down in `memory` how far it got."""
    arc, gap = project(way, x, y)
    left = path_length(way) - arc + gap
    if left < memory[LEAST_LEFT] - 0.05 or left > memory[LEAST_LEFT] + 1.0:
        memory[LEAST_LEFT], memory[SINCE] = left, time
        return True
    return bool(time - memory[SINCE] <= STUCK_AFTER + TICK)


@kernel
def visit_step(
    way: NDArray[np.float64], x: float, y: float, heading: float, goal: tuple[float, float], stop: float
) -> tuple[int, float]:
    """What an errand asks for now: `WALK`, `TURN` with a yaw rate in rad/s, or `ACT`.

    Args:
        way: Floor points to follow, m, shape (k, 2).
        x: Where the person is, m.
        y: Where the person is, m.
        heading: Where the person faces, rad.
        goal: What is reached for, m.
        stop: How near to the goal the walk ends, m.
    """
    arrived = distance(x, y, way[-1, 0], way[-1, 1]) < ARRIVED
    if distance(x, y, goal[0], goal[1]) > stop and not arrived:
        return WALK, 0.0
    turn, error = turn_towards(heading, x, y, goal[0], goal[1])
    if abs(error) > FACING:
        return TURN, turn
    return ACT, 0.0


@kernel
def rollout_visit(
    body: NDArray[np.float64],
    gait: Gait,
    floor: Floor,
    way: NDArray[np.float64],
    shown: bool,
    stray: float,
    goal: tuple[float, float],
    stop: float,
    face: bool,
    time: float,
    things: NDArray[np.float64],
    minded: NDArray[np.bool_],
    errand: int,
    walls: NDArray[np.float64],
    moves: NDArray[np.float64],
    memories: NDArray[np.float64],
) -> int:
    """Moves of an errand until it asks for something else, or until the person thinks again.

    Args:
        body: The body now, as in `mjsim.fidelity.kinematics`; it is moved.
        gait: How the body walks.
        floor: What it walks into.
        way: Floor points to follow, m, shape (k, 2).
        shown: The way is one that is shown, and what lies behind is cut off at every step.
        stray: How far from the way another one is needed, m.
        goal: What is reached for, m.
        stop: How near to the goal the walk ends, m.
        face: Turn to the goal when it is reached.
        time: Simulated time, s.
        things: What may lie in the way, with `minded`, `errand` and `walls`; see `walking.sidestep`.
        minded: See `walking.sidestep`.
        errand: See `walking.sidestep`.
        walls: See `walking.sidestep`.
        moves: Takes forward, left, turn and look of every step, shape (limit, 4).
        memories: Takes the walk's memory after every step, shape (limit + 1, 2); row 0 holds it as it is now.

    Returns:
        How many steps were foreseen.
    """
    for k in range(len(moves)):
        x, y, heading = body[X], body[Y], body[HEADING]
        if project(way, x, y)[1] > stray:
            return k
        ahead = rest_of(way, x, y) if shown else way
        todo, turn = visit_step(ahead, x, y, heading, goal, stop)
        if todo == ACT or (todo == TURN and not face):
            return k
        memories[k + 1] = memories[k]
        forward, left = 0.0, 0.0
        if todo == WALK:
            if not headway(ahead, x, y, time + k * gait.dt, memories[k + 1]):
                return k
            forward, left, turn = follow(ahead, x, y, heading, things, minded, errand, walls)
        moves[k, 0], moves[k, 1], moves[k, 2], moves[k, 3] = forward, left, turn, 0.0
        walk_body(body, forward, left, turn, 0.0, gait, floor)
    return len(moves)
