"""Check that errors name the fault of an invalid problem or plan, and that integer distances are a metric."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.checker import check
from planner.errors import PlannerError, ProblemError
from planner.plan import Plan, Status, Visit, VisitKind
from planner.problem import RoutingProblem, Shipment
from planner.solvers import SOLVERS, SolveLimit, solver

LINE = np.abs(np.subtract.outer(np.arange(4.0), np.arange(4.0)))
PICK, PLACE = VisitKind.PICK, VisitKind.PLACE


def problem(**changes):
    """Return a problem on a line: start at 0, a shipment from 1 to 3, and a carried object for 2."""
    fields = {"distances": LINE, "start": 0, "shipments": (Shipment(1, 3),), "onboard": (2,), "capacity": 2}
    fields |= {} if changes.keys() & {"shipments", "onboard"} else {"names": ("mug", "sock")}
    return RoutingProblem(**{**fields, **changes})


GOOD = Plan((Visit(PICK, "mug"), Visit(PLACE, "sock"), Visit(PLACE, "mug")), 3.0, 3.0, Status.OPTIMAL, 0.0)


def altered(position, value):
    d = LINE.copy()
    d[position] = value
    return d


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"distances": np.zeros((2, 3))}, r"\(2, 3\)"),
        ({"distances": np.zeros((0, 0))}, "square"),
        ({"distances": altered((0, 1), -1)}, r"\[0\]\[1\] is -1"),
        ({"distances": altered((2, 1), np.nan)}, r"\[2\]\[1\] is nan"),
        ({"distances": altered((2, 1), np.inf)}, r"\[2\]\[1\] is inf"),
        ({"distances": altered((1, 2), 5)}, r"\[1\]\[2\].*symmetric"),
        ({"distances": altered((3, 3), 1)}, r"\[3\]\[3\].*diagonal"),
        ({"capacity": 0}, "capacity"),
        ({"onboard": (1, 2, 3)}, "3 objects are onboard"),
        ({"start": 4}, "start 4"),
        ({"onboard": (-1,)}, "onboard -1"),
        ({"shipments": (Shipment(4, 0),)}, "pickup 4"),
        ({"shipments": (Shipment(0, 9),)}, "delivery 9"),
        ({"names": ("mug",)}, "2 objects need as many different names"),
        ({"names": ("mug", "mug")}, "2 objects need as many different names"),
    ],
)
def test_malformed_problems_are_refused_by_name(changes, fault):
    with pytest.raises(ProblemError, match=fault):
        problem(**changes)


@pytest.mark.parametrize(
    ("changes", "capacity", "fault"),
    [
        ({"visits": GOOD.visits[:2]}, 2, "never done"),
        ({"visits": (*GOOD.visits, GOOD.visits[1])}, 2, "not carried"),
        ({"visits": (GOOD.visits[0], *GOOD.visits)}, 2, "is not loose"),
        ({"visits": (GOOD.visits[2], GOOD.visits[0], GOOD.visits[1])}, 2, "not carried"),
        ({}, 1, "capacity of 1"),
        ({"visits": (Visit(PICK, "sock"), *GOOD.visits[1:])}, 2, "is not loose"),
        ({"visits": (Visit(PICK, "can"), *GOOD.visits[1:])}, 2, "unknown object"),
        ({"cost": 2.9, "lower_bound": 2.9}, 2, "not 2.9 m"),
        ({"lower_bound": 3.1}, 2, "lower bound"),
        ({"lower_bound": 2.0}, 2, "gap of 1.0"),
        ({"status": Status.INFEASIBLE}, 2, "infeasible"),
    ],
)
def test_wrong_plans_are_refused_by_name(changes, capacity, fault):
    with pytest.raises(ProblemError, match=fault):
        check(problem(capacity=capacity), dataclasses.replace(GOOD, **changes))


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_integer_distances_are_a_metric_close_to_the_real_one(seed):
    points = np.random.default_rng(seed).uniform(0, 10, (12, 2))
    points[3] = points[4]
    d = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    pair = (Shipment(0, 1),) * 5 + tuple(Shipment(k, k) for k in range(12))
    integers = RoutingProblem(d, 0, pair, resolution=1e-4).integers
    m = integers.metric
    assert m.dtype == np.int64
    np.testing.assert_array_equal(m, m.T)
    assert (m[:, None, :] <= m[:, :, None] + m[None, :, :]).all()
    assert m[3, 4] == 0
    # Rounding changes a leg by half a unit, and each of the two legs of a shorter detour by another half.
    assert np.abs(m * 1e-4 - d).max() <= 2e-4


def test_solvers_are_found_by_name():
    for name in SOLVERS:
        assert solver(name).name == name
    with pytest.raises(PlannerError, match="'magic'"):
        solver("magic")


def test_limits_must_leave_something_to_do():
    for limits in ({"work": 0}, {"seconds": -1.0}):
        with pytest.raises(PlannerError, match=next(iter(limits))):
            SolveLimit(**limits)
