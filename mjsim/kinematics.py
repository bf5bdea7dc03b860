"""Walking without physics: the person's servos and trunk as numba kernels, one control step at a time.

A body is one array of `BODY_SIZE` numbers, laid out by the indices below. Any numba kernel may step it:

    @kernel
    def ten_steps_ahead(body, gait, floor):
        for _ in range(10):
            walk(body, 1.4, 0.0, 0.3, 0.0, gait, floor)  # forward m/s, left m/s, turn rad/s, look rad/s

    body = standing(x, y, heading, pitch)
    ten_steps_ahead(body, Gait.of(model, options), Floor.of(model))

`walk` changes `body` in place and returns nothing. It slews the commands as `Person.walk` does, then lets the four
servos follow them in steps of the physics, with the masses, gains and force limits of the compiled model. The trunk
is a disc that slides along the outlines of the house and never enters them. Loose objects are no obstacles.
"""

import math
from typing import NamedTuple

import mujoco
import numpy as np
import shapely
from numpy.typing import NDArray

from mjsim import avatar, slewing
from mjsim.footprint import footprint
from mjsim.kernels import kernel
from mjsim.options import WorldOptions

X, Y, HEADING, PITCH = 0, 1, 2, 3  # m, m, rad (unwrapped), rad
VX, VY, TURN_RATE, PITCH_RATE = 4, 5, 6, 7  # in the house frame, m/s, rad/s
FORWARD, LEFT, TURN, LOOK = 8, 9, 10, 11  # commanded: m/s and rad/s in the body frame; pitch of the head, rad
SERVO = 12  # first of four: what x, y, yaw and pitch were told last, in the house frame
BODY_SIZE = 16

_TRUNK_BAND = (0.04, 1.72)  # heights of the trunk, m
_LONGEST = 0.05  # m; a disc of 0.20 m cannot jump over a wall in strides of this length
_CELL = 0.25  # m
_KNOWN = 0.12  # m beyond the trunk that a cell of the grid knows of
_ROUNDS = 12
_TOUCHING = 1e-7  # m


class Gait(NamedTuple):
    """Limits of walking and the servos that carry it out; SI units.

    Attributes:
        max_speed, max_turn, max_look, acceleration, turn_acceleration: As in `WorldOptions`.
        dt: Control step.
        substeps: Physics steps in it.
        mass, walk_gain, walk_force: What x and y move, the gain of their velocity servos, and their force limit.
        inertia, turn_gain, turn_force: Of the yaw's velocity servo.
        head_inertia, head_stiffness, head_damping, head_force: Of the head's position servo.
        lowest, highest: Range of the head's pitch.
        radius: Of the trunk.
    """

    max_speed: float
    max_turn: float
    max_look: float
    acceleration: float
    turn_acceleration: float
    dt: float
    substeps: int
    mass: float
    walk_gain: float
    walk_force: float
    inertia: float
    turn_gain: float
    turn_force: float
    head_inertia: float
    head_stiffness: float
    head_damping: float
    head_force: float
    lowest: float
    highest: float
    radius: float

    @classmethod
    def of(cls, model: mujoco.MjModel, options: WorldOptions) -> "Gait":
        """Read a compiled scene with a person."""
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        inertia = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, inertia)
        names = [avatar.PREFIX + joint for joint in ("x", "yaw", "pitch")]
        moved = [float(inertia[dof, dof]) for dof in (int(model.joint(n).dofadr[0]) for n in names)]
        servos = [model.actuator(name) for name in names]
        stiffness = [float(-servo.biasprm[1]) for servo in servos]
        damping = [float(-servo.biasprm[2]) for servo in servos]
        force = [float(servo.forcerange[1]) for servo in servos]
        return cls(
            max_speed=options.max_speed,
            max_turn=options.max_turn,
            max_look=options.max_look,
            acceleration=options.acceleration,
            turn_acceleration=options.turn_acceleration,
            dt=options.control_timestep,
            substeps=round(options.control_timestep / model.opt.timestep),
            mass=moved[0],
            walk_gain=damping[0],
            walk_force=force[0],
            inertia=moved[1],
            turn_gain=damping[1],
            turn_force=force[1],
            head_inertia=moved[2],
            head_stiffness=stiffness[2],
            head_damping=damping[2],
            head_force=force[2],
            lowest=avatar.PITCH_RANGE[0],
            highest=avatar.PITCH_RANGE[1],
            radius=avatar.TRUNK_RADIUS,
        )


class Legs(NamedTuple):
    """All that a walk without physics depends on, for kernels that foresee one.

    Attributes:
        body: The body now; copy it before stepping it.
        gait: How it walks.
        floor: What it walks into.
    """

    body: NDArray[np.float64]
    gait: "Gait"
    floor: "Floor"


class Floor(NamedTuple):
    """Outlines of what the trunk meets, with a grid that says which are near; for kernels.

    Attributes:
        edges: Edges of all convex polygons, counter-clockwise: start x, y, direction x, y, and length, m, shape (e, 5).
        first: Polygon p has the edges `first[p]` to `first[p + 1]`, shape (p + 1,).
        boxes: Each polygon's least and largest x, and least and largest y, m, shape (p, 4).
        near: Polygons that may touch the trunk, cell by cell.
        near_first: Cell i, j has the entries of `near` from `near_first[i * columns + j]`, shape (cells + 1,).
        origin_x, origin_y: Corner of cell 0, 0, m.
        rows, columns: Cells along x and y.
    """

    edges: NDArray[np.float64]
    first: NDArray[np.int64]
    boxes: NDArray[np.float64]
    near: NDArray[np.int64]
    near_first: NDArray[np.int64]
    origin_x: float
    origin_y: float
    rows: int
    columns: int

    @classmethod
    def of(cls, model: mujoco.MjModel, radius: float = avatar.TRUNK_RADIUS) -> "Floor":
        """Outlines of the static geoms at the heights of the trunk.

        Raises:
            AssetError: The house has no rooms, or a static geom's outline is not known.
        """
        low, high = _TRUNK_BAND
        return cls.of_polygons(footprint(model, low=low, high=high).obstacles, radius)

    @classmethod
    def of_polygons(cls, polygons: tuple[NDArray[np.float64], ...], radius: float) -> "Floor":
        """Convex counter-clockwise polygons (k, 2), m, for a trunk of this radius, m."""
        reach = radius + _KNOWN
        boxes = np.array([[*p.min(axis=0), *p.max(axis=0)] for p in polygons]).reshape(-1, 4)
        low = boxes[:, :2].min(axis=0, initial=np.inf) - reach if len(polygons) else np.zeros(2)
        high = boxes[:, 2:].max(axis=0, initial=-np.inf) + reach if len(polygons) else np.ones(2)
        rows, columns = (int(n) for n in np.ceil((high - low) / _CELL))
        i, j = (index.ravel() for index in np.mgrid[:rows, :columns])
        x, y = low[0] + _CELL * i, low[1] + _CELL * j
        cells = shapely.box(x, y, x + _CELL, y + _CELL)
        tree = shapely.STRtree([shapely.Polygon(polygon) for polygon in polygons])
        cell, near = tree.query(cells, predicate="dwithin", distance=reach)
        order = np.lexsort((near, cell))
        edges = [_edges(polygon) for polygon in polygons]
        counts = np.bincount(cell, minlength=rows * columns)
        return cls(
            edges=np.concatenate([np.zeros((0, 5)), *edges]),
            first=np.cumsum([0, *(len(sides) for sides in edges)], dtype=np.int64),
            boxes=np.ascontiguousarray(boxes[:, [0, 2, 1, 3]]),
            near=np.ascontiguousarray(near[order].astype(np.int64)),
            near_first=np.concatenate(([0], np.cumsum(counts))).astype(np.int64),
            origin_x=float(low[0]),
            origin_y=float(low[1]),
            rows=rows,
            columns=columns,
        )


def _edges(polygon: NDArray[np.float64]) -> NDArray[np.float64]:
    """Start, direction and length of the sides of a polygon (k, 2), shape (k, 5); none of length 0."""
    sides = np.roll(polygon, -1, axis=0) - polygon
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    keep = lengths > 0.0
    return np.column_stack((polygon[keep], sides[keep] / lengths[keep, None], lengths[keep]))


def standing(x: float, y: float, heading: float, pitch: float = avatar.START_PITCH) -> NDArray[np.float64]:
    """A body at rest, its commands at what it does; shape (BODY_SIZE,)."""
    body = np.zeros(BODY_SIZE)
    body[[X, Y, HEADING, PITCH]] = x, y, heading, pitch
    body[LOOK] = body[SERVO + 3] = pitch
    return body


@kernel
def walk(
    body: NDArray[np.float64], forward: float, left: float, turn: float, look: float, gait: Gait, floor: Floor
) -> None:
    """One control step of walking, turning and looking, as `Move(forward, left, turn, look)` asks."""
    command(body, forward, left, turn, look, gait)
    advance(body, gait, floor)


@kernel
def command(
    body: NDArray[np.float64], forward: float, left: float, turn: float, look: float, gait: Gait
) -> None:
    """Slew the commands towards what `Move(forward, left, turn, look)` asks; `advance` carries them out."""
    motion = body[FORWARD:SERVO]
    slewing.slew_walk(motion, forward, left, gait.max_speed, gait.acceleration * gait.dt)
    slewing.slew_turn(motion, turn, gait.max_turn, gait.turn_acceleration * gait.dt)
    slewing.slew_look(motion, look, gait.max_look, gait.lowest, gait.highest, gait.dt)


@kernel
def brake(body: NDArray[np.float64], turn: float, gait: Gait) -> None:
    """Slew the walk to a stand and the yaw rate towards `turn`, rad/s."""
    motion = body[FORWARD:SERVO]
    slewing.slew_walk(motion, 0.0, 0.0, gait.max_speed, gait.acceleration * gait.dt)
    slewing.slew_turn(motion, turn, gait.max_turn, gait.turn_acceleration * gait.dt)


@kernel
def look_at(body: NDArray[np.float64], pitch: float, gait: Gait) -> None:
    """Command a pitch of the head, rad, kept within what a neck can do."""
    body[LOOK] = min(gait.highest, max(gait.lowest, pitch))


@kernel
def advance(body: NDArray[np.float64], gait: Gait, floor: Floor) -> None:
    """One control step of the servos, ramped from the last commands to the present ones, and of the trunk."""
    heading = body[HEADING] + 0.5 * body[TURN] * gait.dt
    c, s = math.cos(heading), math.sin(heading)
    to_x = c * body[FORWARD] - s * body[LEFT]
    to_y = s * body[FORWARD] + c * body[LEFT]
    to_turn, to_pitch = body[TURN], body[LOOK]
    h = gait.dt / gait.substeps
    ramp_x, ramp_y = (to_x - body[SERVO]) / gait.substeps, (to_y - body[SERVO + 1]) / gait.substeps
    ramp_turn, ramp_pitch = (
        (to_turn - body[SERVO + 2]) / gait.substeps,
        (to_pitch - body[SERVO + 3]) / gait.substeps,
    )
    walk, turn = _servo(gait.mass, gait.walk_gain, h), _servo(gait.inertia, gait.turn_gain, h)
    head = _servo(gait.head_inertia, gait.head_damping, h)
    # No servo overshoots what it was told before or is told now.
    reach_x = gait.radius + gait.dt * max(abs(body[VX]), abs(body[SERVO]), abs(to_x))
    reach_y = gait.radius + gait.dt * max(abs(body[VY]), abs(body[SERVO + 1]), abs(to_y))
    free = _free(body[X], body[Y], reach_x, reach_y, gait.radius, floor)
    for k in range(1, gait.substeps + 1):
        push_x = gait.walk_gain * (body[SERVO] + k * ramp_x)
        push_y = gait.walk_gain * (body[SERVO + 1] + k * ramp_y)
        torque = gait.turn_gain * (body[SERVO + 2] + k * ramp_turn)
        spring = gait.head_stiffness * (body[SERVO + 3] + k * ramp_pitch - body[PITCH])
        body[VX] = _driven(body[VX], push_x, gait.walk_gain, gait.walk_force, walk)
        body[VY] = _driven(body[VY], push_y, gait.walk_gain, gait.walk_force, walk)
        body[TURN_RATE] = _driven(body[TURN_RATE], torque, gait.turn_gain, gait.turn_force, turn)
        body[PITCH_RATE] = _driven(body[PITCH_RATE], spring, gait.head_damping, gait.head_force, head)
        if free:
            body[X] += h * body[VX]
            body[Y] += h * body[VY]
        else:
            _stride(body, h, gait.radius, floor)
        body[HEADING] += h * body[TURN_RATE]
        body[PITCH] += h * body[PITCH_RATE]
    body[SERVO], body[SERVO + 1], body[SERVO + 2], body[SERVO + 3] = to_x, to_y, to_turn, to_pitch


@kernel
def _servo(mass: float, damping: float, h: float) -> tuple[float, float, float]:
    """What of its speed a servo keeps in a physics step, what it gains by a force, and what of that undamped."""
    return mass / (mass + h * damping), h / (mass + h * damping), h / mass


@kernel
def _driven(
    speed: float, push: float, damping: float, limit: float, servo: tuple[float, float, float]
) -> float:
    """Speed after a step under the force `push - damping * speed`, implicit in the damping unless saturated."""
    force = push - damping * speed
    if force > limit or force < -limit:
        return speed + servo[2] * min(limit, max(-limit, force))
    return servo[0] * speed + servo[1] * push


@kernel
def _free(x: float, y: float, reach_x: float, reach_y: float, radius: float, floor: Floor) -> bool:
    """Whether no outline comes within these distances along x and y."""
    if max(reach_x, reach_y) > radius + _KNOWN:
        return False  # farther than the grid knows
    start, end = _near(x, y, floor)
    for entry in range(start, end):
        box = floor.boxes[floor.near[entry]]
        if box[0] - reach_x < x < box[1] + reach_x and box[2] - reach_y < y < box[3] + reach_y:
            return False
    return True


@kernel
def _near(x: float, y: float, floor: Floor) -> tuple[int, int]:
    """Which entries of `Floor.near` are those of a point's cell."""
    i, j = math.floor((x - floor.origin_x) / _CELL), math.floor((y - floor.origin_y) / _CELL)
    if not (0 <= i < floor.rows and 0 <= j < floor.columns):
        return 0, 0
    cell = i * floor.columns + j
    return floor.near_first[cell], floor.near_first[cell + 1]


@kernel
def _stride(body: NDArray[np.float64], h: float, radius: float, floor: Floor) -> None:
    """Move the trunk by its velocity for `h` seconds, sliding along what it meets."""
    length = h * math.sqrt(body[VX] * body[VX] + body[VY] * body[VY])
    parts = 1 + int(length / _LONGEST)
    for _ in range(parts):
        x, y = body[X], body[Y]
        body[X] += body[VX] * (h / parts)
        body[Y] += body[VY] * (h / parts)
        start, end = _near(x, y, floor)
        if start < end and not _push_out(body, radius, floor, start, end):
            # Wedged between walls: stay where it was.
            body[X], body[Y], body[VX], body[VY] = x, y, 0.0, 0.0


@kernel
def _push_out(body: NDArray[np.float64], radius: float, floor: Floor, start: int, end: int) -> bool:
    """Move the disc out of the polygons near[start:end], and turn its velocity along them; whether that is possible."""
    for _ in range(_ROUNDS):
        free = True
        for entry in range(start, end):
            polygon = floor.near[entry]
            box = floor.boxes[polygon]
            if not (
                box[0] - radius < body[X] < box[1] + radius and box[2] - radius < body[Y] < box[3] + radius
            ):
                continue
            gap, nx, ny = _gap(body[X], body[Y], floor.edges, floor.first[polygon], floor.first[polygon + 1])
            if gap >= radius - _TOUCHING:
                continue
            free = False
            body[X] += nx * (radius - gap)
            body[Y] += ny * (radius - gap)
            into = nx * body[VX] + ny * body[VY]
            if into < 0.0:
                body[VX] -= into * nx
                body[VY] -= into * ny
        if free:
            return True
    return False


@kernel
def _gap(x: float, y: float, edges: NDArray[np.float64], first: int, last: int) -> tuple[float, float, float]:
    """Signed distance of a point to a convex polygon, m, and the direction away from it."""
    nearest, near_x, near_y = math.inf, 0.0, 0.0
    depth, out_x, out_y = -math.inf, 0.0, 0.0
    for edge in range(first, last):
        dx, dy = x - edges[edge, 0], y - edges[edge, 1]
        ex, ey = edges[edge, 2], edges[edge, 3]
        beside = dx * ey - dy * ex  # positive outside, to the right of the edge
        if beside > depth:
            depth, out_x, out_y = beside, ey, -ex
        along = min(edges[edge, 4], max(0.0, dx * ex + dy * ey))
        dx, dy = dx - along * ex, dy - along * ey
        distance = dx * dx + dy * dy
        if distance < nearest:
            nearest, near_x, near_y = distance, dx, dy
    nearest = math.sqrt(nearest)
    if depth <= 0.0 or nearest < 1e-12:
        return depth, out_x, out_y
    return nearest, near_x / nearest, near_y / nearest
