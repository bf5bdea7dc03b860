"""Replanning beside a person: a good plan at once, its proof in the background, no switching between equal plans."""

import queue
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from planner.exact.solver import ExactSolver
from planner.exact.warm_start import NOTHING_KNOWN
from planner.geodesics import Geodesics
from planner.plan import Plan, Status, Visit, VisitKind
from planner.problem import RoutingProblem
from planner.replanner import Replanner
from planner.route import Route, TaskState, remaining
from planner.solver import SolveLimit, Solver
from planner.tour import tour_length

TIE = 0.01  # m; tours closer than this are equal: rounding to 0.1 mm alone can add up to it
PROOF_LIMIT = SolveLimit(seconds=20.0)


@dataclass(frozen=True, eq=False)
class _Proof:
    """The search for something better than the shown visits, which goes on in a thread.

    Attributes:
        problem: What is solved.
        shown: The visits shown, from the state of the problem on.
        stop: Set to stop it.
        results: Better and better plans, or the exception that ended the search.
    """

    problem: RoutingProblem
    shown: tuple[Visit, ...]
    stop: threading.Event
    results: "queue.SimpleQueue[Plan | Exception]" = field(default_factory=queue.SimpleQueue)

    def run(self, plans: Iterator[Plan]) -> None:
        """Collect plans until there are no more, or `stop` is set."""
        try:
            for plan in plans:
                self.results.put(plan)
                if self.stop.is_set():
                    return
        except Exception as error:
            self.results.put(error)

    def drain(self) -> list[Plan]:
        """Plans since the last call; raises the exception that ended the search."""
        plans: list[Plan] = []
        while True:
            try:
                result = self.results.get_nowait()
            except queue.Empty:
                return plans
            if isinstance(result, Exception):
                raise result
            plans.append(result)


class LiveReplanner(Replanner):
    """A replanner for live use. The caller's thread gets a plan within some 50 ms and never waits for its proof.

    `update` and `plan` answer with a first plan; from then on `poll`, at every control step, costs nothing until the
    background search has found something. What was learnt about the objects (multipliers of the bound, the order of
    the route) is kept by name for all later replans of an episode: it stays valid when objects are moved, dropped,
    added or removed. Call `prepare` while the person still looks around.

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
        super().__init__(geodesics, solver, capacity=capacity, seed=seed, limit=limit or PROOF_LIMIT)
        self._proof: _Proof | None = None
        self._thread: threading.Thread | None = None
        self._warm = NOTHING_KNOWN

    def __enter__(self) -> "LiveReplanner":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop the background search; waits for its current layer, a fraction of a second."""
        self._stop_proof()
        if self._thread is not None:
            self._thread.join()

    @property
    def busy(self) -> bool:
        """Whether a search is going on."""
        return self._thread is not None and self._thread.is_alive()

    @property
    def pending(self) -> bool:
        """Whether the search has found something since the last `poll`."""
        return self._proof is not None and not self._proof.results.empty()

    def wait(self, seconds: float | None = None) -> None:
        """Wait until the search is over, at most so long; for the time before a task begins, and for tests."""
        if self._thread is not None:
            self._thread.join(seconds)

    def prepare(self, state: TaskState, *, seconds: float | None = None) -> Route:
        """Plan the task and wait for the proof, at most so long; loads all kernels, learns the multipliers."""
        route = self.plan(state)
        self.wait(seconds)
        return self.poll(state) or route

    def update(self, state: TaskState, *, shown: bool = True) -> Route:  # noqa: ARG002 - nobody waits for it
        """See :class:`planner.replanner.Replanner`; a new plan starts from earlier ones, shown or not."""
        return super().update(state)

    def plan(self, state: TaskState) -> Route:
        """Follow the first plan from now on, and look for a better one in the background.

        Raises:
            UnreachableError: Objects that cannot be fetched or delivered; `names` lists them.
            ProblemError: More is carried than the capacity allows.
        """
        self._stop_proof()
        problem, stop = self.problems.problem(state), threading.Event()
        plans = self._plans(problem, state, stop)
        first = next(plans)
        self._warm = self._warm.updated(problem, first)
        self._start(_Proof(problem, first.visits, stop), plans)
        return self._follow(Route(first.visits, first), state)

    def poll(self, state: TaskState) -> Route | None:
        """A better route, or the same one with a better bound, if the search has found one; costs nothing otherwise.

        The shown route stays unless another is shorter by more than rounding, measured from where the person is now.
        So among equals the suggestion does not switch.

        Raises:
            UnreachableError: Objects that cannot be fetched or delivered; `names` lists them.
        """
        proof = self._proof
        plans = proof.drain() if proof is not None else []
        rest = self._rest(state) if plans else None
        if proof is None or rest is None:
            return None  # nothing new, or `update` has to be called first
        for plan in plans:
            self._warm = self._warm.updated(proof.problem, plan)
        better = remaining(plans[-1].visits, state)
        if better is None:  # it begins otherwise than what was done meanwhile: search anew, from here
            self._stop_proof()
            problem, stop = self.problems.problem(state), threading.Event()
            self._start(_Proof(problem, rest, stop), self._plans(problem, state, stop))
            return None
        return self._choose(state, proof, plans[-1], rest, better)

    def _choose(
        self,
        state: TaskState,
        proof: _Proof,
        plan: Plan,
        rest: tuple[Visit, ...],
        better: tuple[Visit, ...],
    ) -> Route | None:
        """Choose between the shown rest and that of a new plan."""
        cost, new_cost = self.problems.length(state, rest), self.problems.length(state, better)
        if new_cost < cost - TIE:
            self._proof = replace(proof, shown=plan.visits)
            return self._follow(Route(better, plan), state)
        before, shown = self.route.plan, _with_bound(proof, plan)
        self._route = Route(rest, shown)
        return self._route if shown.improves_on(before) else None

    def _stop_proof(self) -> None:
        if self._proof is not None:
            self._proof.stop.set()
        self._proof = None

    def _start(self, proof: _Proof, plans: Iterator[Plan]) -> None:
        self._proof = proof
        self._thread = threading.Thread(target=proof.run, args=(plans,), name="proof", daemon=True)
        self._thread.start()

    def _plans(self, problem: RoutingProblem, state: TaskState, stop: threading.Event) -> Iterator[Plan]:
        limit = replace(self._limit or PROOF_LIMIT, stop=stop)
        if not isinstance(self._solver, ExactSolver):
            return self._solver.improve(problem, seed=self._seed, limit=limit)
        warm = self._warm
        if self._route is not None:
            picks = [
                v.object for v in self._route.visits if v.kind is VisitKind.PICK and v.object in state.loose
            ]
            moved = set(self._moved(state, picks))
            warm = replace(warm, order=tuple(name for name in picks if name not in moved))
        return self._solver.improve(problem, seed=self._seed, limit=limit, warm=warm)


def _with_bound(proof: _Proof, other: Plan) -> Plan:
    """The plan of the shown visits, with the bound of another plan of the same problem."""
    cost = tour_length(proof.problem, proof.shown)
    optimal = other.status is Status.OPTIMAL and cost <= other.lower_bound + proof.problem.tolerance(cost)
    lower = cost if optimal else min(other.lower_bound, cost)
    status = Status.OPTIMAL if optimal else Status.FEASIBLE
    return Plan(proof.shown, cost, lower, status, other.seconds, other.certificate)
