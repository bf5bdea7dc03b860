"""Models of shortest flows for MathOpt. GLOP finds fractional flows, and HiGHS finds integer flows."""

import math
from collections.abc import Callable, Sequence
from datetime import timedelta
from functools import partial

import numpy as np
from numpy.typing import NDArray
from ortools.math_opt.python import mathopt

from planner.exact.cuts.connectivity import Cut
from planner.exact.cuts.graph import StateGraph
from planner.solvers import Deadline

# How long before a deadline solvers stop, because they check the time only now and then, in seconds
MARGIN = 0.05
GAP = 0.4  # difference between length and bound at which HiGHS stops, because lengths are whole numbers


class FlowModel:
    """Unit flows from the root to the end that enter the nodes of each object once and satisfy all cuts.

    `step` is the number of units by which lengths are counted. Lengths are rounded down to a multiple of it.
    """

    def __init__(self, graph: StateGraph, step: int, cuts: Sequence[Cut], *, integer: bool) -> None:
        self.graph, self.model = graph, mathopt.Model()
        self.cuts: list[mathopt.LinearConstraint] = []
        # Fractional flows need no upper bounds, because the other constraints imply them.
        most = graph.most.tolist() if integer else [math.inf] * len(graph.most)
        self.flow = [self.model.add_variable(lb=0.0, ub=bound, is_integer=integer) for bound in most]
        self.cover = [self.model.add_linear_constraint(lb=1.0, ub=1.0) for _ in range(graph.objects)]
        nodes, ends = np.unique([graph.tail, graph.head]).tolist(), {graph.root: -1.0, graph.end: 1.0}
        surplus = {node: ends.get(node, 0.0) for node in nodes}
        balance = {node: self.model.add_linear_constraint(lb=s, ub=s) for node, s in surplus.items()}
        fields = (graph.tail, graph.head, graph.picks, graph.length // step)
        for flow, tail, head, k, length in zip(self.flow, *(field.tolist() for field in fields), strict=True):
            self.model.objective.set_linear_coefficient(flow, length)
            balance[tail].set_coefficient(flow, -1.0)
            balance[head].set_coefficient(flow, 1.0)
            if k >= 0:
                self.cover[k].set_coefficient(flow, 1.0)
        for cut in cuts:
            self.add(cut)

    def add(self, cut: Cut) -> None:
        row, weights = self.model.add_linear_constraint(lb=0.0), cut.coefficients(self.graph)
        for a in np.flatnonzero(weights).tolist():
            row.set_coefficient(self.flow[a], float(weights[a]))
        self.cuts.append(row)

    def values(self, result: mathopt.SolveResult) -> NDArray[np.float64]:
        """Return the flow on each arc."""
        return np.array(result.variable_values(self.flow))

    def multipliers(self, result: mathopt.SolveResult) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the dual values of the objects and of the cuts. Their unit is a step."""
        return np.array(result.dual_values(self.cover)), np.array(result.dual_values(self.cuts))


class FractionalSolver:
    """A solver that continues with its last solution after cuts were added to a model."""

    def __init__(self, model: FlowModel) -> None:
        self._solver = mathopt.IncrementalSolver(model.model, mathopt.SolverType.GLOP)

    def solve(self, deadline: Deadline) -> mathopt.SolveResult | None:
        """Find a shortest flow. Return None if there was not enough time, or if the solver failed."""
        result = _solved(self._solver.solve, mathopt.SolveParameters(threads=1), deadline)
        optimal = result is not None and result.termination.reason is mathopt.TerminationReason.OPTIMAL
        return result if optimal else None


def integer_flow(model: FlowModel, nodes: int, deadline: Deadline) -> mathopt.SolveResult | None:
    """Find a short integer flow and a bound. Return None if the solver failed.

    The search ends when it has found a shortest flow, when the deadline's time has come, or after `nodes` nodes of its
    tree. The deadline's event has no effect, because MathOpt cannot interrupt HiGHS.
    """
    parameters = mathopt.SolveParameters(
        absolute_gap_tolerance=GAP, relative_gap_tolerance=0.0, node_limit=nodes
    )
    parameters.highs.int_options["threads"] = 1  # HiGHS does not accept the parameter `threads` of MathOpt
    parameters.highs.string_options["parallel"] = "off"
    return _solved(partial(mathopt.solve, model.model, mathopt.SolverType.HIGHS), parameters, deadline)


def _solved(
    solve: Callable[..., mathopt.SolveResult], parameters: mathopt.SolveParameters, deadline: Deadline
) -> mathopt.SolveResult | None:
    if (left := deadline.left) < math.inf:
        parameters.time_limit = timedelta(seconds=max(0.0, left - MARGIN))
    try:
        return solve(params=parameters)
    except (AttributeError, RuntimeError, ValueError):
        return None  # MathOpt 9.15 raises an AttributeError while it converts the error of a solver
