"""Replanning beside a live person: a good plan at once, its proof in the background, no flipping between equals."""

import math
import queue
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

from planner.certificate import Certificate, Proof
from planner.exact.solver import ExactSolver
from planner.exact.warm import Warm, same_groups
from planner.geodesics import Geodesics
from planner.plan import Plan, Status, Visit, VisitKind
from planner.problem import RoutingProblem
from planner.replanner import MOVED, Replanner, Stop, left_of, named
from planner.route import Route, RouteVisit, TaskState
from planner.solver import SolveLimit, Solver
from planner.tour import UNIT, pick, place, place_onboard, tour_length

TIE = 0.01  # m; tours closer than this are equal: rounding to 0.1 mm alone can add up to it
PATIENCE = SolveLimit(seconds=20.0)


@dataclass(frozen=True, eq=False)
class _Proof:
    """The search for something better than the shown stops, going on in a thread.

    Attributes:
        problem: What is solved.
        names: Names of its shipments.
        state: The state that it is of.
        thread: Runs the solver; None before it starts.
        stop: Set to stop it.
        found: Better and better plans, or the exception that ended the search.
    """

    problem: RoutingProblem
    names: list[str]
    state: TaskState
    stop: threading.Event = field(default_factory=threading.Event)
    found: "queue.SimpleQueue[Plan | Exception]" = field(default_factory=queue.SimpleQueue)

    def run(self, plans: Iterator[Plan]) -> None:
        """Collect plans until there are no more, or somebody says stop."""
        try:
            for plan in plans:
                self.found.put(plan)
                if self.stop.is_set():
                    return
        except Exception as error:
            self.found.put(error)

    def drain(self) -> list[Plan]:
        """What was found since the last call; raises what the search died of."""
        plans: list[Plan] = []
        while True:
            try:
                found = self.found.get_nowait()
            except queue.Empty:
                return plans
            if isinstance(found, Exception):
                raise found
            plans.append(found)

    def visits(self, stops: Sequence[Stop]) -> list[Visit]:
        """Stops as visits of the problem."""
        index = {name: k for k, name in enumerate(self.names)}
        held = {name: k for k, name in enumerate(self.state.carried)}
        visits = []
        for kind, name in stops:
            if name in held:
                visits.append(place_onboard(self.problem, held[name]))
            else:
                visit = pick if kind is VisitKind.PICK else place
                visits.append(visit(self.problem, index[name]))
        return visits


class LiveReplanner(Replanner):
    """A replanner for live use. The caller's thread gets a plan within some 50 ms and is never held up by its proof.

    `update` and `plan` answer with a first plan; from then on `poll`, at every control step, costs nothing until the
    background search has found something. What was learnt about the objects (prices of the bound, the order of the
    route) is kept by name for all later replans of an episode: it stays valid when objects are moved, dropped, added
    or removed. Call `prepare` while people still look around.

    Results depend on the machine's speed; runs that must repeat use :class:`planner.replanner.Replanner`. That the
    search does not hold up the caller holds for the exact planner, whose kernels run without the interpreter's lock.

    Args:
        geodesics: Distances and paths.
        solver: Finds the tours; the exact one makes use of what was learnt.
        capacity: How many objects can be carried.
        seed: Handed to the solver.
        limit: Of each proof; by default 20 s.
    """

    def __init__(
        self,
        geodesics: Geodesics,
        solver: Solver,
        *,
        capacity: int = 2,
        seed: int = 0,
        limit: SolveLimit | None = None,
    ) -> None:
        super().__init__(geodesics, solver, capacity=capacity, seed=seed, limit=limit or PATIENCE)
        self._proof: _Proof | None = None
        self._thread: threading.Thread | None = None
        self._stops: list[Stop] = []  # the shown ones, from the state of the proof on
        self._prices: dict[str, int] = {}
        self._groups: list[list[str]] = []

    def __enter__(self) -> "LiveReplanner":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop the background search; waits for its current layer, a fraction of a second."""
        self._leave_proof()
        if self._thread is not None:
            self._thread.join()

    @property
    def busy(self) -> bool:
        """Whether a search is going on."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def pending(self) -> bool:
        """Whether the search has found something since the last `poll`."""
        return self._proof is not None and not self._proof.found.empty()

    def wait(self, seconds: float | None = None) -> None:
        """Wait until the search is over, at most so long; for the time before a task begins, and for tests."""
        if self._thread is not None:
            self._thread.join(seconds)

    def prepare(self, state: TaskState, *, seconds: float | None = None) -> Route:
        """Plan the task and wait for the proof, at most so long; compiles or loads all kernels, learns the prices."""
        route = self.plan(state)
        self.wait(seconds)
        return self.poll(state) or route

    def poll(self, state: TaskState) -> Route | None:
        """A better route, or the same one with a better bound, if the search has found one; costs nothing otherwise.

        The shown route stays unless another is shorter by more than rounding, measured from where the person is now.
        So among equals the suggestion does not flip.

        Raises:
            UnreachableError: Objects that cannot be fetched or delivered; `names` lists them.
        """
        proof = self._proof
        plans = proof.drain() if proof is not None else []
        rest = self._rest(state) if plans else None
        if proof is None or rest is None:
            return None  # nothing new, or `update` has to be called first
        for plan in plans:
            self._learn(plan, proof.names)
        stops = left_of(named(plans[-1], proof.names, proof.state), state)
        if stops is None:  # it begins otherwise than what was done meanwhile: ask anew, from here
            self._prove(state, [(v.kind, v.object) for v in rest])
            return None
        return self._settle(state, proof, plans[-1], rest, stops)

    def _settle(
        self, state: TaskState, proof: _Proof, plan: Plan, rest: list[RouteVisit], stops: list[Stop]
    ) -> Route | None:
        """Choose between the shown rest and the stops of a plan."""
        spots = self._spots(state)
        here = self._snap(state.position)
        shown = [replace(v, location=spots[v.kind, v.object]) for v in rest]
        other = [RouteVisit(kind, name, spots[kind, name]) for kind, name in stops]
        cost = self._length(here, [v.location for v in shown])
        other_cost = self._length(here, [v.location for v in other])
        before = self.route.plan
        if other_cost < cost - TIE:
            self._stops = named(plan, proof.names, proof.state)
            self._planned = dict(state.loose)
            self._route = Route(tuple(other), other_cost, plan)
            return self._route
        kept = _with_bound(proof, self._stops, plan)
        self._route = Route(tuple(shown), cost, kept)
        return self._route if kept.improves_on(before) else None

    def _first_plan(
        self, problem: RoutingProblem, names: list[str], state: TaskState, limit: SolveLimit | None
    ) -> Plan:
        proof = self._begin(problem, names, state)
        plans = self._plans(proof, limit)
        first = next(plans)
        self._learn(first, names)
        self._stops = named(first, names, state)
        self._start(proof, plans)
        return first

    def _prove(self, state: TaskState, stops: list[Stop]) -> None:
        """Look for something better than the given stops from this state on, all of it in the background."""
        problem, names = self._problem(state, self._spots(state))
        proof = self._begin(problem, names, state)
        self._stops = stops
        self._start(proof, self._plans(proof, self.limit))

    def _begin(self, problem: RoutingProblem, names: list[str], state: TaskState) -> _Proof:
        self._leave_proof()
        self._proof = _Proof(problem, names, state)
        return self._proof

    def _leave_proof(self) -> None:
        if self._proof is not None:
            self._proof.stop.set()
        self._proof = None

    def _start(self, proof: _Proof, plans: Iterator[Plan]) -> None:
        self._thread = threading.Thread(target=proof.run, args=(plans,), name="proof", daemon=True)
        self._thread.start()

    def _plans(self, proof: _Proof, limit: SolveLimit | None) -> Iterator[Plan]:
        limit = replace(limit or PATIENCE, stop=proof.stop)
        if isinstance(self.solver, ExactSolver):
            warm = self._warm(proof.state, proof.names)
            return self.solver.improve(proof.problem, seed=self.seed, limit=limit, warm=warm)
        return self.solver.improve(proof.problem, seed=self.seed, limit=limit)

    def _learn(self, plan: Plan, names: list[str]) -> None:
        certificate = plan.certificate
        if certificate is not None and certificate.proof is Proof.RELAXATION:
            self._prices.update(zip(names, certificate.multipliers, strict=True))
            self._groups = [[names[k] for k in members] for members in certificate.groups]

    def _warm(self, state: TaskState, names: list[str]) -> Warm | None:
        """What is known of these objects; what is new costs the average."""
        known = [self._prices[name] for name in names if name in self._prices]
        if not known or self._route is None:
            return None
        average = sum(known) // len(known)
        prices = tuple(self._prices.get(name, average) for name in names)
        picks = [v.object for v in self._route.visits if v.kind is VisitKind.PICK and v.object in names]
        order = picks + [name for name in names if name not in picks]
        astray = [
            name
            for name in names
            if name not in picks or math.dist(self._planned[name], state.loose[name]) > MOVED
        ]
        index = names.index
        certificate = Certificate(Proof.RELAXATION, 0, same_groups(self._groups, names), prices)
        return Warm(certificate, tuple(map(index, order)), tuple(map(index, astray)))


def _with_bound(proof: _Proof, stops: Sequence[Stop], other: Plan) -> Plan:
    """The plan of the given stops, with the bound of another plan of the same problem."""
    visits = proof.visits(stops)
    cost = tour_length(proof.problem.distances, proof.problem.start, visits)
    optimal = other.status is Status.OPTIMAL and cost <= other.lower_bound + 2 * UNIT * len(visits)
    lower = cost if optimal else min(other.lower_bound, cost)
    status = Status.OPTIMAL if optimal else Status.FEASIBLE
    return Plan(tuple(visits), cost, lower, status, other.seconds, other.certificate)
