"""Stress tests of walking, in which a person runs at 1 to 8 m/s into walls, corners, furniture and objects.

In each session, the person runs and pushes in random directions, walks away along the shortest path, and then
stands for a while. Tunnelling, getting stuck and drift are detected only from the body's position and the
floor plan, independently of the code under test.
"""

import math
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import NDArray

from benchmarks.support.parallel_sessions import session_episode, upright_object
from experiments.house import House
from mjsim.house.compiled.footprint import footprint
from mjsim.house.scene.scene import assemble
from mjsim.values.actions import IDLE, Move
from mjsim.values.episode import Episode
from mjsim.values.errors import PhysicsError
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.walking.polyline import point_along
from mjsim.world.world import World
from planner.errors import UnreachableError

SEED = 2028
SPEEDS = (1.0, 8.0)  # range of running speeds in m/s
ACCELERATION = 12.0  # commanded acceleration in m/s^2, which exceeds the limits of the body's servos
SECONDS = 36.0  # duration of a session in seconds
CHARGE, PUSH, RETREAT, STAND = (0.8, 2.5), (0.4, 1.2), 2.0, 1.0  # durations of parts of a session in seconds
HEAPED, LAYER = 6, 0.33  # objects per heap, and vertical distance between them in metres
ROOM = 0.4  # radius of the free floor around a heap, in metres
NOT_STUCK = 0.2  # minimum distance in metres that a body covers in `RETREAT` seconds unless it is stuck
RETREAT_SPEED = 1.4  # walking speed during a retreat in m/s
LOOK_AHEAD = 0.3  # look-ahead distance along the path, in metres


@dataclass
class WalkResult:
    """The result of a walking session.

    Attributes:
        session: Number of the session, with which `run_session` can repeat it.
        speed: Commanded running speed, m/s.
        simulated: Simulated time, s.
        tunnelled: Number of control steps in which the body's axis was inside or had passed through a solid
            obstacle.
        stuck: Number of retreats in which the body moved less than `NOT_STUCK` m.
        drift: Distance moved in the last second of each standing period, m.
        turned: Rotation in the last second of each standing period, rad.
        overlap: Penetration depth of the trunk into walls and furniture at each control step, m.
        fastest: Largest speed of any object, m/s.
        lost: Number of objects outside the house at the end.
        error: Message of a physics error, or None.
    """

    session: int
    speed: float
    simulated: float = 0.0
    tunnelled: int = 0
    stuck: int = 0
    retreats: int = 0
    drift: list[float] = field(default_factory=list)
    turned: list[float] = field(default_factory=list)
    overlap: list[float] = field(default_factory=list)
    fastest: float = 0.0
    ejections: int = 0
    object_tunnellings: int = 0
    lost: int = 0
    error: str | None = None


def run_session(house: House, number: int, seconds: float = SECONDS) -> WalkResult:
    """Run the session with this number. The same number always gives a bit-identical result."""
    return _Session(house, number).run(seconds)


class _Session:
    def __init__(self, house: House, number: int) -> None:
        self._house = house
        self._rng = np.random.default_rng([SEED, number])
        self._found = WalkResult(number, float(self._rng.uniform(*SPEEDS)))
        self._heap = _free_place(house, self._rng)
        # With this value, the person's `fastest_walk` is equal to the speed of the session.
        person = PersonParameters(
            walking_speed=self._found.speed * 13 / 14, walking_acceleration=ACCELERATION
        )
        scene = assemble(_episode(house, number, self._heap, self._rng), house.catalogue, person=person)
        self._solid = shapely.union_all([shapely.Polygon(p) for p in footprint(scene.model).obstacles])
        shapely.prepare(self._solid)
        self._world = World(scene)
        self._position = self._world.observation().position

    def run(self, seconds: float) -> WalkResult:
        found, world = self._found, self._world
        try:
            while world.observation().time < seconds:
                self._charge()
                self._retreat()
                self._stand()
        except PhysicsError as error:
            found.error = str(error)
        o, health = world.observation(), world.health
        found.simulated = o.time
        found.ejections, found.object_tunnellings = health.ejections, health.tunnellings
        inside = [world.scene.rooms.contains(p[:2], 0.3) and p[2] > -0.05 for p in o.object_positions]
        found.lost = inside.count(False)
        return found

    def _charge(self) -> None:
        """Run in a random direction, or every third time at the heap, then push at another angle."""
        rng, o = self._rng, self._world.observation()
        at_heap = rng.random() < 1 / 3
        offset = self._heap - o.position
        course = math.atan2(offset[1], offset[0]) if at_heap else rng.uniform(-math.pi, math.pi)
        for duration, veer in ((CHARGE, 0.0), (PUSH, rng.uniform(-1.6, 1.6))):
            turn = rng.uniform(-2.5, 2.5)
            for _ in range(self._steps(rng.uniform(*duration))):
                self._go(course + veer, self._found.speed, turn)

    def _retreat(self) -> None:
        """Walk away along the shortest path to a distant point."""
        house, start = self._house, self._position
        goal = _far_point(house, house.navmesh.snap(start), self._rng)
        self._found.retreats += 1
        farthest = 0.0
        for _ in range(self._steps(RETREAT)):
            here = house.navmesh.snap(self._position)
            path = np.asarray(house.geodesics.shortest_path(here, goal).points)
            # If the person has left the navigable floor, the path first leads back to it.
            out, ahead = here - self._position, np.array(point_along(path, LOOK_AHEAD)) - here
            course = 4.0 * out + ahead / LOOK_AHEAD
            self._go(math.atan2(course[1], course[0]), RETREAT_SPEED, 0.0)
            farthest = max(farthest, float(np.linalg.norm(self._position - start)))
        self._found.stuck += farthest < NOT_STUCK

    def _stand(self) -> None:
        """Stop, and then measure for a while whether the body stays in place."""
        for _ in range(self._steps(STAND)):
            self._step(IDLE)
        before = self._world.observation()
        for _ in range(self._steps(STAND)):
            self._step(IDLE)
        after = self._world.observation()
        self._found.drift.append(float(np.linalg.norm(after.position - before.position)))
        self._found.turned.append(abs(after.heading - before.heading))

    def _go(self, course: float, speed: float, turn: float) -> None:
        angle = course - self._world.observation().heading
        self._step(Move(speed * math.cos(angle), speed * math.sin(angle), turn))

    def _step(self, move: Move) -> None:
        found, world = self._found, self._world
        o = world.step(move).observation
        trail = shapely.LineString([self._position, o.position])
        found.tunnelled += bool(self._solid.intersects(trail))
        gap = self._solid.distance(shapely.Point(o.position))
        found.overlap.append(max(0.0, self._world.scene.person.body_radius - gap))
        dofs = world.scene.index.dofs[:, None] + np.arange(3)
        found.fastest = max(found.fastest, float(np.linalg.norm(world.data.qvel[dofs], axis=1).max()))
        self._position = o.position

    def _steps(self, seconds: float) -> int:
        return max(1, round(seconds / self._world.control_timestep))


def _free_place(house: House, rng: np.random.Generator) -> NDArray[np.float64]:
    """Sample a floor point with free space around it."""
    around = [ROOM * np.array([math.cos(a), math.sin(a)]) for a in np.arange(0, 6.2, 0.5)]
    while True:
        point = house.navmesh.sample(rng)
        if all(house.navmesh.is_navigable(point + offset) for offset in around):
            return point


def _far_point(house: House, here: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Sample a floor point that is too far away to be reached during a retreat."""
    while True:
        goal = house.navmesh.sample(rng)
        try:
            if house.geodesics.shortest_path(here, goal).geodesic_distance > 2.0 * RETREAT * RETREAT_SPEED:
                return goal
        except UnreachableError:
            continue


def _episode(house: House, number: int, heap: NDArray[np.float64], rng: np.random.Generator) -> Episode:
    """Place the person at a random floor point, and objects that fall onto a heap at another point (2,)."""
    start = house.navmesh.sample(rng)
    while np.linalg.norm(start - heap) < 1.0:
        start = house.navmesh.sample(rng)
    objects = []
    for i, model in enumerate(rng.choice(list(house.catalogue.objects), HEAPED, replace=False)):
        xy, yaw = heap + rng.uniform(-0.1, 0.1, 2), rng.uniform(-math.pi, math.pi)
        objects.append(upright_object(house, i, str(model), xy, 0.01 + LAYER * i, yaw))
    return session_episode(house, number, start, float(rng.uniform(-math.pi, math.pi)), objects)
