"""Models of shortest flows for MathOpt. GLOP finds fractional flows, and HiGHS finds integer flows."""

import math
from collections.abc import Callable, Sequence
from datetime import timedelta
from functools import partial

import numpy as np
from numpy.typing import NDArray
from ortools.math_opt import model_pb2
from ortools.math_opt.python import mathopt

from planner.exact.cuts.connectivity import Cut
from planner.exact.cuts.graph import StateGraph
from planner.solvers import Deadline

MARGIN = (
    0.05  # how long before a deadline solvers stop, because they check the time only now and then, in seconds
)
GAP = 0.4  # difference between length and bound at which HiGHS stops, because lengths are whole numbers


class FlowModel:
    """Unit flows from the root to the end that enter the nodes of each object once and satisfy all cuts.

    `step` is the number of units by which lengths are counted. Lengths are rounded down to a multiple of it.
    """

    def __init__(self, graph: StateGraph, step: int, cuts: Sequence[Cut], *, integer: bool) -> None:
        arcs, nodes = np.arange(len(graph.tail)), np.unique([graph.tail, graph.head])
        surplus = (nodes == graph.end).astype(float) - (nodes == graph.root)
        bounds = np.concatenate([np.ones(graph.objects), surplus])
        picking = graph.picks >= 0
        weights = np.array([cut.coefficients(graph) for cut in cuts]).reshape(len(cuts), len(arcs))
        cut_rows, cut_arcs = np.nonzero(weights)
        ends = np.searchsorted(nodes, [graph.head, graph.tail]) + graph.objects
        rows = np.concatenate([graph.picks[picking], *ends, cut_rows + len(bounds)])
        columns = np.concatenate([arcs[picking], arcs, arcs, cut_arcs])
        values = np.repeat([1.0, 1.0, -1.0], [picking.sum(), len(arcs), len(arcs)])
        values = np.append(values, weights[cut_rows, cut_arcs])
        order = np.lexsort((columns, rows))
        proto = model_pb2.ModelProto()
        proto.variables.ids.extend(arcs.tolist())
        proto.variables.lower_bounds.extend([0.0] * len(arcs))
        # Fractional flows need no upper bounds, because the other constraints imply them.
        most = graph.most.tolist() if integer else [math.inf] * len(arcs)
        proto.variables.upper_bounds.extend(most)
        proto.variables.integers.extend([integer] * len(arcs))
        proto.objective.linear_coefficients.ids.extend(arcs.tolist())
        proto.objective.linear_coefficients.values.extend((graph.length // step).tolist())
        proto.linear_constraints.ids.extend(range(len(bounds) + len(cuts)))
        proto.linear_constraints.lower_bounds.extend([*bounds.tolist(), *[0.0] * len(cuts)])
        proto.linear_constraints.upper_bounds.extend([*bounds.tolist(), *[math.inf] * len(cuts)])
        proto.linear_constraint_matrix.row_ids.extend(rows[order].tolist())
        proto.linear_constraint_matrix.column_ids.extend(columns[order].tolist())
        proto.linear_constraint_matrix.coefficients.extend(values[order].tolist())
        self.graph = graph
        self.model = mathopt.Model.from_model_proto(proto)
        self.flow = list(self.model.variables())
        constraints = list(self.model.linear_constraints())
        self.cover, self.cuts = constraints[: graph.objects], constraints[len(bounds) :]

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
