"""Small planning problems, tasks and plain recursions that several tests of the planner share."""

import functools

import numpy as np

from mjsim.support.kernels import kernel
from planner.exact.solver import ExactSolver
from planner.geodesics import Geodesics
from planner.navmesh import NavMesh
from planner.plan import VisitKind
from planner.problem import RoutingProblem, Shipment
from planner.regret import RegretEvaluator
from planner.route import TaskState
from planner.service import Planner
from planner.solver_source import SolverSource

WALL = [
    np.array([(3.9, 0), (4.1, 0), (4.1, 4), (3.9, 4)]),
    np.array([(3.9, 5), (4.1, 5), (4.1, 8), (3.9, 8)]),
]
# An exact planner without a table, and with a small budget.
SEARCH = ExactSolver(table_bytes=0, passes=((100, 3_000), (1_000, 30_000)))
FAR = 1 << 60
BINS = [(1.0, 7.0), (7.0, 7.0), (7.0, 1.0)]


def random_problem(seed, shipments, onboard=0, capacity=2, bins=4, coincide=False, planar=True):
    """Points in the plane, or of a coarse grid: location 0 is the start, then the bins, then the objects."""
    rng = np.random.default_rng(seed)
    count = 1 + bins + shipments
    if planar:
        points = rng.uniform(0, 10, (count, 2))
        if coincide:
            points = np.round(points / 5) * 5
        d = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    else:  # any numbers between 1 and 2 are a metric, and one with many near ties
        d = np.triu(rng.uniform(1, 2, (count, count)).round(1), 1)
        d = d + d.T
    deliveries = rng.integers(1, bins + 1, shipments)
    return RoutingProblem(
        d,
        0,
        tuple(Shipment(1 + bins + k, int(deliveries[k])) for k in range(shipments)),
        tuple(int(j) for j in rng.integers(1, bins + 1, onboard)),
        capacity,
    )


def optimum(problem, number=float):
    """Least length, added as a type of `number`, by recursion: every possible visit, one after another."""
    d = [[number(x) for x in row] for row in problem.distances.tolist()]

    @functools.cache
    def go(here, loose, carried):
        ways = [d[here][j] + go(j, loose, carried[:k] + carried[k + 1 :]) for k, j in enumerate(carried)]
        if len(carried) < problem.capacity:
            for k in loose:
                s = problem.shipments[k]
                held = tuple(sorted((*carried, s.delivery)))
                ways.append(d[here][s.pickup] + go(s.pickup, loose - {k}, held))
        return min(ways, default=number(0))

    return go(problem.start, frozenset(range(len(problem.shipments))), tuple(sorted(problem.onboard)))


@kernel
def oracle(d, start, pickup, delivery, onboard, capacity):
    """Return the minimum tour length by dynamic programming over the states of all objects.

    An object is loose (0), carried (1) or delivered (2). The row of the table is a number in base 3 whose
    digit k is the state of object k, with carried objects last. The column is the current location.
    """
    n, k = pickup.size, pickup.size + onboard.size
    codes = 3**k
    cost = np.full((codes, len(d)), FAR, np.int64)
    code = 0
    for i in range(n, k):
        code += 3**i
    cost[code, start] = 0
    best = FAR
    for code in range(codes):  # every visit leads to a larger code
        carried, done = 0, 0
        for i in range(k):
            carried += code // 3**i % 3 == 1
            done += code // 3**i % 3 == 2
        for here in range(len(d)):
            so_far = cost[code, here]
            if so_far == FAR:
                continue
            if done == k:
                best = min(best, so_far)
            for i in range(k):
                state = code // 3**i % 3
                if state == 2 or (state == 0 and carried == capacity):
                    continue
                goal = delivery[i] if i < n else onboard[i - n]
                there = pickup[i] if state == 0 else goal
                after = code + 3**i
                cost[after, there] = min(cost[after, there], so_far + d[here, there])
    return best


def expected(problem):
    return int(
        oracle(
            problem.integers.metric,
            problem.start,
            np.array([s.pickup for s in problem.shipments], np.int64),
            np.array([s.delivery for s in problem.shipments], np.int64),
            np.array(problem.onboard, np.int64),
            problem.capacity,
        )
    )


def grid_problem(rng, most, capacity):
    """Return a problem on a coarse grid with Manhattan or Euclidean distances. Places may coincide."""
    n, side = int(rng.integers(0, most + 1)), int(rng.integers(1, 6))
    places = int(rng.integers(2, 3 + n + 4))
    points = rng.integers(0, side, (places, 2)).astype(float)
    apart = np.abs(points[:, None] - points[None])
    d = apart.sum(axis=2) if rng.random() < 0.5 else np.hypot(apart[..., 0], apart[..., 1])
    bins = rng.integers(0, places, int(rng.integers(1, n + 2)))  # often a different bin for every object
    shipments = tuple(Shipment(int(rng.integers(places)), int(rng.choice(bins))) for _ in range(n))
    onboard = tuple(int(j) for j in rng.choice(bins, int(rng.integers(0, capacity + 1))))
    return RoutingProblem(d, int(rng.integers(places)), shipments, onboard, capacity)


def two_rooms():
    """Geodesics of two rooms of 4 m x 8 m, a door between them."""
    return Geodesics(NavMesh.build(WALL, (0, 0, 8, 8)))


def planner_of(geodesics, solver, *, live=False, **options):
    """A planner that asks a solver."""
    return Planner(SolverSource(geodesics, solver, **options), RegretEvaluator(geodesics), live=live)


def asked(planner, state, **options):
    """The route of a planner for a state."""
    planner.ask(state, **options)
    return planner.route


class Task:
    """A task that is carried out visit by visit, in `two_rooms`."""

    def __init__(self, geodesics, count, seed=0):
        self.rng = np.random.default_rng(seed)
        self.mesh = geodesics.navmesh
        self.loose = {f"object_{k:02}": self.anywhere() for k in range(count)}
        self.deliveries = {name: BINS[k % 3] for k, name in enumerate(self.loose)}
        self.carried = []
        self.position = self.anywhere()

    def anywhere(self):
        return tuple(map(float, self.mesh.sample(self.rng)))

    @property
    def state(self):
        return TaskState(self.position, dict(self.loose), tuple(self.carried), self.deliveries)

    def place(self, visit):
        """Where a visit happens."""
        return self.loose[visit.object] if visit.kind is VisitKind.PICK else self.deliveries[visit.object]

    def do(self, kind, name):
        if kind is VisitKind.PICK:
            self.position = self.loose.pop(name)
            self.carried.append(name)
        else:
            self.position = self.deliveries[name]
            self.carried.remove(name)

    def misfortune(self):
        """Something that was not planned; the person stands where it happened."""
        kind = self.rng.integers(5)
        if kind == 0 and self.carried:  # dropped
            self.loose[self.carried.pop()] = self.anywhere()
        elif kind == 1 and self.loose:  # kicked
            self.loose[sorted(self.loose)[0]] = self.anywhere()
        elif kind == 2:  # something new
            name = f"new_{len(self.deliveries)}"
            self.loose[name], self.deliveries[name] = self.anywhere(), BINS[0]
        elif kind == 3 and len(self.loose) > 1:  # somebody else took it
            del self.loose[sorted(self.loose)[-1]]
        elif len(self.carried) < 2 and self.loose:  # another object than suggested
            self.do(VisitKind.PICK, sorted(self.loose)[int(self.rng.integers(len(self.loose)))])
        self.position = self.anywhere()
