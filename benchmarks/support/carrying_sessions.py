"""Sessions in which the person carries two objects through the house at full speed, to measure weld errors.

The person picks up two nearby objects and walks to another point of the house along the shortest path. The
speed is 1.4 m/s, even around corners.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.support.parallel_sessions import session_episode, upright_object
from experiments.house import House
from mjsim.house.scene.scene import compose
from mjsim.values.actions import IDLE, WAIT, Action, EventKind, Move, Pick
from mjsim.values.episode import Episode
from mjsim.world.walking.path_following import wrap_angle
from mjsim.world.walking.polyline import path_length, point_along, project
from mjsim.world.world import World

SEED = 2027
SPEED = 1.4  # walking speed in m/s
LOOK_AHEAD = 0.3  # look-ahead distance along the path, in metres
BRAKING = 1.5  # deceleration at the end of the path, in m/s^2
PICK_DISTANCE = 0.55  # distance from the person to objects that can be picked up, in metres
MIN_LENGTH = 6.0  # minimum length of a path in metres
MAX_STEPS = 900  # maximum number of control steps per walk
ARRIVED = 0.1  # distance from the goal at which a walk ends, in metres


@dataclass(frozen=True)
class CarryResult:
    """The result of a walk with two objects that takes T control steps.

    Attributes:
        session: Number of the session, with which `run_session` can repeat it.
        lost: Number of objects that slipped out of a hand.
        length: Length of the path, m.
        speed: Speed of the body, m/s, (T,).
        turn: Yaw rate of the body, rad/s, (T,).
        stretch: Translational weld error of each hand, m, (T, 2), or NaN if the hand is empty.
        twist: Rotational weld error of each hand, rad, (T, 2).
        penetration: Depth of the deepest penetration, m, (T,).
    """

    session: int
    models: tuple[str, str]
    lost: int
    arrived: bool
    length: float
    speed: NDArray[np.float64]
    turn: NDArray[np.float64]
    stretch: NDArray[np.float64]
    twist: NDArray[np.float64]
    penetration: NDArray[np.float64]


def run_session(house: House, number: int) -> CarryResult:
    """Run the session with this number. The same number always gives a bit-identical result."""
    rng = np.random.default_rng([SEED, number])
    path = _path(house, rng)
    episode = _episode(house, number, path[0], rng)
    world = World(compose(episode, house.catalogue))
    for placed in episode.objects:
        world.step(Pick(placed.name))
        world.step(WAIT)
    rows, lost = [], 0
    heading = world.observation().heading
    for _ in range(MAX_STEPS):
        o = world.observation()
        step = world.step(_towards(path, o.position, o.heading))
        lost += sum(event.kind is EventKind.GRIP_LOST for event in step.events)
        o = step.observation
        rate = wrap_angle(o.heading - heading) / world.control_timestep
        heading = o.heading
        rows.append((float(np.hypot(*o.velocity)), rate, *world.health_sample.row))
        if np.linalg.norm(o.position - path[-1]) < ARRIVED:
            break
    table = np.array(rows)
    first, second = (o.model for o in episode.objects)
    return CarryResult(
        session=number,
        models=(first, second),
        lost=lost,
        arrived=bool(np.linalg.norm(world.observation().position - path[-1]) < ARRIVED),
        length=float(path_length(path)),
        speed=table[:, 0],
        turn=table[:, 1],
        stretch=table[:, 4:6],
        twist=table[:, 6:8],
        penetration=table[:, 2],
    )


def _path(house: House, rng: np.random.Generator) -> NDArray[np.float64]:
    while True:
        start, goal = house.navmesh.sample(rng), house.navmesh.sample(rng)
        around = [
            start + PICK_DISTANCE * np.array([math.cos(a), math.sin(a)]) for a in np.arange(0, 6.2, 0.8)
        ]
        if all(house.navmesh.is_navigable(point) for point in around):
            path = np.asarray(house.geodesics.shortest_path(start, goal).points)
            if path_length(path) >= MIN_LENGTH:
                return path


def _episode(house: House, number: int, start: NDArray[np.float64], rng: np.random.Generator) -> Episode:
    """Place the person at a floor point (2,) with a random object in front of each hand."""
    heading = float(rng.uniform(-math.pi, math.pi))
    objects = []
    for i, side in enumerate((0.8, -0.8)):
        model = str(rng.choice(list(house.catalogue.objects)))
        angle, yaw = heading + side, rng.uniform(-math.pi, math.pi)
        xy = start + PICK_DISTANCE * np.array([math.cos(angle), math.sin(angle)])
        objects.append(upright_object(house, i, model, xy, 0.01, yaw))
    return session_episode(house, number, start, heading, objects)


def _towards(path: NDArray[np.float64], position: NDArray[np.float64], heading: float) -> Action:
    """Return a move that follows a path (k, 2) at full speed and slows down at its end."""
    x, y = (float(v) for v in position)
    arc, _ = project(path, x, y)
    to_x, to_y = point_along(path, arc + LOOK_AHEAD)
    left = math.hypot(path[-1, 0] - x, path[-1, 1] - y)
    distance = math.hypot(to_x - x, to_y - y)
    if distance < 1e-6:
        return IDLE
    speed = min(SPEED, math.sqrt(2.0 * BRAKING * left)) / distance
    c, s = math.cos(heading), math.sin(heading)
    dx, dy = to_x - x, to_y - y
    turn = wrap_angle(math.atan2(dy, dx) - heading)
    return Move(speed * (c * dx + s * dy), speed * (c * dy - s * dx), 5.0 * turn)
