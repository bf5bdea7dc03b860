"""Prove tours with cutting planes, and then with integer flows that are solved by branch and bound.

Budgets count rounds and nodes, so equal problems give equal results. A linear relaxation yields a bound, which is
computed again exactly. Arcs that only longer tours can use are removed. If a shortest integer flow is a tour, this tour
is optimal. Otherwise, cuts that its cycles violate are added, and the smaller problem is solved again.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import cast

import numpy as np
from numpy.typing import NDArray
from ortools.math_opt.python import mathopt

from planner.exact.annealing import anneal, inserted, tour_actions, tour_units
from planner.exact.cuts.connectivity import Cut, violated
from planner.exact.cuts.flow_model import FlowModel, FractionalSolver, integer_flow
from planner.exact.cuts.graph import LONGEST, StateGraph, state_graph, walks
from planner.exact.cuts.root_bound import RootBound, root_bound
from planner.exact.instance import Instance
from planner.exact.moves import moves_of
from planner.exact.table import INFINITE, Solution
from planner.solvers import Deadline

RESTARTS, MOVES, TEMPERATURES = 4, 100_000, (0.3, 0.02)  # annealing before the first round, in about 0.5 s
REPAIR_MOVES, REPAIR_TEMPERATURES = 20_000, (0.05, 0.01)  # annealing of a flow's joined cycles
ROUNDS = 50  # maximum number of linear relaxations
STEP_S = 0.1  # time that a step may take after it can no longer be interrupted, in seconds
CORE = 1_000  # number of arcs in the first integer round, which often finds a shortest tour within 0.5 s
NEW_CUTS = 60  # maximum number of cuts that are added in a round
PATIENCE, PROGRESS = 5, 2e-4  # number of rounds in which the bound must rise by this share of itself
ROUND_WORK, NODE_WORK = 20_000, 40_000  # work of a round and of a node, in expanded states that take as long
INFEASIBLE = (mathopt.TerminationReason.INFEASIBLE, mathopt.TerminationReason.INFEASIBLE_OR_UNBOUNDED)
PARTS = 1024  # parts of a unit in which multipliers are rounded


def tours_by_cuts(
    instance: Instance, seed: int, work: int, deadline: Deadline, first: Solution
) -> Iterator[Solution]:
    """Yield better tours and bounds than those of a first solution, until a tour is proven or the budget is spent."""
    search = _Search(instance, work, deadline, first)
    if search.ended:
        return
    for _ in search.steps(seed):
        yield search.solution
        if search.ended:
            return


@dataclass(eq=False)
class _Search:
    instance: Instance
    work: int
    deadline: Deadline
    first: Solution
    known: dict[tuple[int, bytes], Cut] = field(default_factory=dict)  # cuts found so far
    nodes: int = 0  # number of nodes of all trees
    root: RootBound | None = None

    def __post_init__(self) -> None:
        self.graph: StateGraph = state_graph(self.instance)
        self.moves = moves_of(self.instance)
        self.step = max(1, -(-int(self.graph.length.max()) // LONGEST))
        self.parts = PARTS if self.step == 1 else 1
        self.upper, self.lower, self.actions = INFINITE, self.first.bound, self.first.actions
        self._offer(np.array([k for k in self.actions if k >= 0], np.int64))

    @property
    def solution(self) -> Solution:
        certificate, root = self.first.certificate, self.root
        if root is not None and self.lower > self.first.bound:
            certificate = root.certificate(self.instance.unit, self.parts, self.nodes)
        return Solution(self.actions, min(self.lower, self.upper), certificate)

    @property
    def ended(self) -> bool:
        return self.lower >= self.upper - self.instance.tie or self.deadline.over()

    def steps(self, seed: int) -> Iterator[None]:
        """Run the search, and pause after each step that may have improved the tour or the bound."""
        n = len(self.instance.home)
        for k in range(min(RESTARTS, self.work // MOVES)):
            if self.deadline.over():
                break
            self.work -= MOVES
            self._anneal(seed + k, MOVES, np.arange(n), TEMPERATURES)
            yield
        yield from self._rounds()
        more, arcs = self.root is not None, CORE
        while more and self.work >= NODE_WORK and self.deadline.left > STEP_S:
            more = self._integer_round(self.work // NODE_WORK, seed, arcs) or arcs < len(self.graph.tail)
            arcs = len(self.graph.tail)
            yield

    def _rounds(self) -> Iterator[None]:
        """Solve linear relaxations, and add the cuts that their flows violate."""
        model = FlowModel(self.graph, self.step, [], integer=False)
        solver, bounds = FractionalSolver(model), [-math.inf] * PATIENCE
        for _ in range(min(ROUNDS, self.work // ROUND_WORK)):
            result = solver.solve(self.deadline) if self.deadline.left > STEP_S else None
            if result is None:
                return
            self.work -= ROUND_WORK
            self._bound(*model.multipliers(result))
            yield
            bounds.append(result.objective_value())
            new = self._new_cuts(self.graph, model.values(result))
            if not new or bounds[-1] - bounds[-1 - PATIENCE] < PROGRESS * bounds[-1]:
                return
            for cut in new:
                model.add(cut)

    def _bound(self, prices: NDArray[np.float64], duals: NDArray[np.float64]) -> None:
        scale = self.parts * self.step
        positive = zip(self.known.values(), np.rint(duals * scale).astype(np.int64).tolist(), strict=True)
        cuts = [(cut, multiplier) for cut, multiplier in positive if multiplier > 0]
        root = root_bound(self.graph, self.parts, np.rint(prices * scale).astype(np.int64), cuts)
        if self.root is None or root.value >= self.root.value:
            self.root, self.lower = root, max(self.lower, root.value)

    def _integer_round(self, nodes: int, seed: int, most_arcs: int) -> bool:
        """Search for a shortest flow on the arcs of tours that may be better. Return True if it is not a tour.

        If there are more than 2.5 times as many arcs, only the `most_arcs` arcs of the shortest tours are used. The
        bound then is at most the length of other tours.
        """
        least = cast(RootBound, self.root).least
        limit = self.upper * self.parts
        if np.count_nonzero(least <= limit) > 2.5 * most_arcs:
            limit = min(limit, int(np.partition(least, most_arcs)[most_arcs]) - 1)
        graph = self.graph.only(least <= limit)
        model = FlowModel(graph, self.step, list(self.known.values()), integer=True)
        result = integer_flow(model, nodes, self.deadline)
        if result is None:
            return False
        other = min(self.upper, limit // self.parts + 1)  # length of a shortest tour with other arcs
        self.nodes += max(1, result.solve_stats.node_count)
        self.work -= max(1, result.solve_stats.node_count) * NODE_WORK
        bound = result.termination.objective_bounds.dual_bound
        if result.termination.reason in INFEASIBLE:
            self.lower = max(self.lower, other)
        elif math.isfinite(bound):  # the error of a bound from floats is far below half a step
            self.lower = max(self.lower, min(other, math.ceil(bound - 0.5) * self.step))
        if not result.has_primal_feasible_solution():
            return False
        flow = np.rint(model.values(result))
        way, *cycles = walks(graph, flow.astype(np.int64))
        order = inserted(self.instance, way, cycles)
        self._offer(order)
        self._anneal(seed, REPAIR_MOVES, order, REPAIR_TEMPERATURES)
        return bool(self._new_cuts(graph, flow))

    def _new_cuts(self, graph: StateGraph, flow: NDArray[np.float64]) -> list[Cut]:
        found = {(cut.object, cut.inside.tobytes()): cut for cut in violated(graph, flow, self.deadline)}
        new = dict([entry for entry in found.items() if entry[0] not in self.known][:NEW_CUTS])
        self.known |= new
        return list(new.values())

    def _anneal(
        self, seed: int, moves: int, order: NDArray[np.int64], temperatures: tuple[float, float]
    ) -> None:
        _, better = anneal(self.instance, seed, moves, order, *temperatures, self.deadline)
        self._offer(better)

    def _offer(self, order: NDArray[np.int64]) -> None:
        length = tour_units(self.instance, order)
        if length < self.upper:
            self.upper, self.actions = length, tour_actions(self.moves, order)
