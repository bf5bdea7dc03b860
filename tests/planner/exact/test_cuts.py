"""Check that branch and cut finds optimal tours, claims nothing that does not hold, and obeys its limits."""

import dataclasses
import itertools
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ortools.math_opt.python import mathopt
from planning_cases import expected, grid_problem, random_problem
from scipy.sparse import csr_array
from scipy.sparse.csgraph import shortest_path

from planner.checker import check, verify_optimal
from planner.cuts_checker import _shortest_walks, cuts_bound
from planner.errors import ProblemError
from planner.exact.cuts import branch_and_cut
from planner.exact.cuts.branch_and_cut import tours_by_cuts
from planner.exact.cuts.flow_model import FlowModel, integer_flow
from planner.exact.cuts.graph import state_graph
from planner.exact.instance import make_instance, to_visits
from planner.exact.solver import ExactSolver
from planner.exact.table import Solution
from planner.exact.task_search import TaskSearch
from planner.plan import Certificate, Plan, Proof, Status
from planner.problem import after, make_plan, possible_next, tour_length
from planner.problem_json import claim_from_json, claim_to_json
from planner.solvers import NEVER, Deadline, SolveLimit, solver

CUTS = ExactSolver(table_bytes=0, most_searched=0)
WORK = 60_000_000


def small_problem(seed, resolution=1e-4):
    """Return a problem on a coarse grid with up to six objects. Bins, objects and the start may coincide."""
    rng = np.random.default_rng(seed)
    while not (problem := grid_problem(rng, 6, 1 + seed % 2)).shipments:
        pass
    return dataclasses.replace(problem, resolution=resolution)


def in_the_given_order(problem):
    """Return a first solution that fetches one object after another, with a bound of 0."""
    instance = make_instance(problem, problem.integers.metric)
    actions = [-1 - b for b in dict.fromkeys(instance.carried.tolist())]
    for k, b in enumerate(instance.home.tolist()):
        actions += [k, -1 - b]
    return instance, Solution(actions, 0, Certificate(Proof.RELAXATION, instance.unit, 0))


def cut_plan(problem):
    """Return the last plan of branch and cut without help from annealing."""
    instance, first = in_the_given_order(problem)
    solution = first
    for solution in tours_by_cuts(instance, 0, WORK, NEVER, first):  # noqa: B007 - the last one is used
        pass
    n = len(problem.shipments)
    visits = to_visits(instance, solution.actions, problem.names[:n], problem.names[n:])
    length = tour_length(problem, visits, problem.integers.metric)
    return make_plan(problem, visits, length, solution.bound, 0.0, solution.certificate)


@pytest.mark.slow
def test_two_hundred_small_problems_of_every_kind_are_solved_to_the_optimum(monkeypatch):
    monkeypatch.setattr(branch_and_cut, "RESTARTS", 0)
    monkeypatch.setattr(branch_and_cut, "REPAIR_MOVES", 1)
    kinds = set()
    for seed in range(200):
        problem = small_problem(seed)
        plan, length = cut_plan(problem), expected(problem)
        assert plan.status is Status.OPTIMAL, seed
        assert int(tour_length(problem, plan.visits, problem.integers.metric)) == length, seed
        check(problem, plan)
        bins = [s.delivery for s in problem.shipments] + list(problem.onboard)
        places = np.unique(bins)
        near = (problem.distances[np.ix_(places, places)] == 0).sum() > len(places)
        kinds.add((problem.capacity, len(problem.onboard), len(places) < len(bins), near))
    assert {kind[:2] for kind in kinds} == {(1, 0), (1, 1), (2, 0), (2, 1), (2, 2)}
    assert {kind[2] for kind in kinds} == {kind[3] for kind in kinds} == {True, False}


@pytest.mark.slow
def test_integer_rounds_alone_connect_the_flow(monkeypatch):
    monkeypatch.setattr(branch_and_cut, "RESTARTS", 0)
    monkeypatch.setattr(branch_and_cut, "REPAIR_MOVES", 1)
    monkeypatch.setattr(branch_and_cut, "ROUNDS", 1)
    monkeypatch.setattr(branch_and_cut, "CORE", 120)

    def in_order(_, way, cycles):
        return np.concatenate([way, *cycles]).astype(np.int64)

    monkeypatch.setattr(branch_and_cut, "inserted", in_order)
    branched = []
    for seed in range(12):
        problem = dataclasses.replace(random_problem(seed, 9, seed % 3), resolution=1e-4)
        plan = cut_plan(problem)
        assert plan.cost == pytest.approx(solver("exact").solve(problem).cost, abs=1e-3)
        assert plan.status is Status.OPTIMAL
        branched.append(plan.certificate.branched)
    assert max(branched) > 1


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_any_multipliers_of_any_cuts_bound_the_optimum(seed):
    problem, rng = small_problem(seed), np.random.default_rng(seed)
    n, graph = len(problem.shipments), state_graph(make_instance(problem, problem.integers.metric))
    nodes = np.arange(len(graph.object) - 2)
    cuts = []
    for share in rng.choice([0.5, 0.9, 1.0], int(rng.integers(4))):
        inside = tuple(nodes[rng.random(len(nodes)) < share].tolist())
        cuts.append((int(rng.integers(n)), int(rng.integers(1, 10**7)), inside))
    # At the planner's own prices, the bound is often equal to the optimum.
    known = np.array(cut_plan(problem).certificate.multipliers or (0,) * n)
    prices = tuple((known + rng.integers(0, 2) * rng.integers(-(10**6), 10**7, n)).tolist())
    claim = Certificate(
        Proof.CUTS, problem.integers.unit, -(10**15), multipliers=prices, cuts=tuple(cuts), parts=1024
    )
    unit = problem.integers.unit
    assert cuts_bound(problem, claim) <= expected(problem) * unit + 1e-9


@pytest.fixture(scope="module")
def proven():
    problem = dataclasses.replace(random_problem(2, 13, 1), resolution=1e-4)
    return problem, CUTS.solve(problem)


def claiming(plan: Plan, **changes) -> Plan:
    return dataclasses.replace(plan, certificate=dataclasses.replace(plan.certificate, **changes))


def test_the_root_bound_is_derived_to_the_unit(proven):
    problem, plan = proven
    root, unit = plan.certificate.root, plan.certificate.unit
    assert plan.certificate.proof is Proof.CUTS
    assert plan.certificate.cuts and plan.certificate.branched > 0
    assert plan.lower_bound > root * unit
    with pytest.raises(ProblemError, match="root claims"):
        check(problem, claiming(plan, root=root + 1))
    loose = claiming(plan, cuts=plan.certificate.cuts[1:])
    with pytest.raises(ProblemError, match="root claims"):
        verify_optimal(problem, loose)
    derived = check(problem, plan)
    assert root * unit - 0.01 <= derived <= root * unit


def test_what_the_checker_does_not_repeat_is_named(proven):
    problem, plan = proven
    read = claim_from_json(claim_to_json(problem, plan), problem)
    assert read.certificate == plan.certificate
    found = verify_optimal(problem, read)
    assert f"branch and bound ({plan.certificate.branched} nodes)" in found.why
    assert found.lower_bound < plan.lower_bound == plan.cost
    assert not found.optimal


START = 4 * 4 + 13 * 5  # number of the state at the start, with four bins and thirteen objects


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"multipliers": (0,) * 12}, "do not fit"),
        ({"cuts": ((13, 1, (0,)),)}, "do not fit"),
        ({"cuts": ((-1, 1, (0,)),)}, "do not fit"),
        ({"cuts": ((0, -1, (0,)),)}, "do not fit"),
        ({"cuts": ((0, 1, (-1,)),)}, "the start or an unknown node"),
        ({"cuts": ((0, 1, (0, START)),)}, "the start or an unknown node"),
        ({"cuts": ((0, 1, (START + 1,)),)}, "the start or an unknown node"),
        ({"cuts": ((0, 1, (10**6,)),)}, "the start or an unknown node"),
        ({"multipliers": (2**58,) * 13}, "multipliers of the certificate are too large"),
        ({"multipliers": (-(2**58),) * 13}, "multipliers of the certificate are too large"),
        ({"parts": 2**50}, "multipliers of the certificate are too large"),
        ({"cuts": ((0, 2**58, (0,)),)}, "multipliers of the certificate are too large"),
        ({"parts": 0}, "do not fit"),
        ({"unit": 0.0}, "do not fit"),
        ({"unit": 1e-300}, "do not fit"),
    ],
)
def test_a_certificate_that_does_not_fit_is_refused_whatever_it_claims(proven, changes, fault):
    problem, plan = proven
    assert len({s.delivery for s in problem.shipments} | set(problem.onboard)) == 4
    with pytest.raises(ProblemError, match=fault):
        check(problem, claiming(plan, **{"root": -(10**15), **changes}))


def test_a_cut_of_all_states_but_the_start_is_accepted(proven):
    problem, plan = proven
    everything = Certificate(
        Proof.CUTS,
        plan.certificate.unit,
        0,
        multipliers=(0,) * 13,
        cuts=((0, 1, tuple(range(START))),),
        parts=1,
    )
    assert cuts_bound(problem, everything) >= 0.0


@pytest.mark.parametrize("seed", range(3))
def test_each_leg_of_a_tour_may_have_been_rounded_up_by_half_a_unit(seed):
    problem = random_problem(seed, 9, seed)
    claim = Certificate(Proof.CUTS, 0.01, -(10**15), multipliers=(0,) * 9, parts=1)
    walks = shortest_path(np.minimum(problem.distances, problem.distances.T))
    whole = dataclasses.replace(problem, distances=np.rint(walks / 0.01))
    exact = cuts_bound(whole, dataclasses.replace(claim, unit=1.0))
    assert exact > 0
    found = cuts_bound(dataclasses.replace(problem, distances=walks), claim)
    assert found == pytest.approx(0.01 * (exact - 0.5 * (2 * 9 + seed)))


@pytest.mark.slow
@pytest.mark.parametrize("onboard", [0, 1, 2])
def test_branch_and_cut_and_the_search_agree(onboard):
    problem = dataclasses.replace(random_problem(onboard, 25, onboard, bins=6), resolution=1e-4)
    plans = [
        planner.solve(problem, limit=SolveLimit(work=WORK))
        for planner in (ExactSolver(), ExactSolver(most_searched=40))
    ]
    assert [plan.status for plan in plans] == [Status.OPTIMAL] * 2
    assert [plan.certificate.proof for plan in plans] == [Proof.CUTS, Proof.RELAXATION]
    assert plans[0].cost == pytest.approx(plans[1].cost, abs=1e-3)


@pytest.mark.slow
def test_plans_get_better_and_repeat():
    problem = dataclasses.replace(random_problem(5, 27, 1, bins=6), resolution=1e-4)
    plans = list(solver("exact").improve(problem, seed=3))
    again = solver("exact").solve(problem, seed=3)
    for earlier, later in itertools.pairwise(plans):
        assert later.cost <= earlier.cost
        assert later.lower_bound >= earlier.lower_bound
    assert dataclasses.replace(plans[-1], seconds=0.0) == dataclasses.replace(again, seconds=0.0)
    assert plans[0].status is Status.FEASIBLE
    assert plans[-1].status is Status.OPTIMAL


def test_lengths_too_fine_for_floats_are_bounded_but_not_proven():
    problem = random_problem(2, 13, 1)
    plan, best = cut_plan(problem), solver("exact").solve(problem)
    assert plan.cost == pytest.approx(best.cost)
    assert plan.status is Status.FEASIBLE
    assert plan.cost * (1 - 1e-4) < plan.lower_bound < plan.cost
    check(problem, plan)


def test_a_stopped_search_adds_no_more_cuts_and_keeps_its_best_tour():
    problem, stop = dataclasses.replace(random_problem(1, 45, bins=6), resolution=1e-4), threading.Event()
    plans = solver("exact").improve(problem, limit=SolveLimit(stop=stop))
    first = next(plans)
    best = next(plan for plan in plans if plan.certificate.proof is Proof.CUTS)
    stop.set()
    assert list(plans) == []
    assert best.status is Status.FEASIBLE
    assert best.cost < first.cost
    assert best.lower_bound > first.lower_bound
    check(problem, best)


@pytest.mark.slow
def test_a_time_limit_interrupts_an_integer_round():
    instance, _ = in_the_given_order(dataclasses.replace(random_problem(1, 60, bins=6), resolution=1e-4))
    model = FlowModel(state_graph(instance), 1, [], integer=True)
    started = time.perf_counter()
    result = integer_flow(model, 10**6, Deadline(started + 1.0))
    assert time.perf_counter() - started < 3
    assert result.termination.limit is mathopt.Limit.TIME


def random_walk(problem, seed):
    """Yield the problems after each of a series of random visits, as long as two objects are loose."""
    rng = np.random.default_rng(seed)
    while len(problem.shipments) > 2:
        options = list(possible_next(problem))
        problem = after(problem, options[rng.integers(len(options))])
        yield problem


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_plans_for_later_states_of_a_large_task_are_bounded_closely(seed):
    problem = dataclasses.replace(random_problem(seed, 9, seed % 3), resolution=1e-4)
    search = TaskSearch(CUTS)
    search.learn(problem, CUTS.solve(problem))
    for later in random_walk(problem, seed):
        plan, best = search.plan(later), ExactSolver().solve(later)
        check(later, plan)
        assert 0.85 * best.cost < plan.lower_bound <= best.cost + 2e-3 <= plan.cost + 4e-3


def test_a_stopped_search_for_a_large_task_has_a_certificate_all_the_same():
    problem, stop = dataclasses.replace(random_problem(3, 9, 1), resolution=1e-4), threading.Event()
    stop.set()
    search = TaskSearch(CUTS)
    plan = search.plan(problem, limit=SolveLimit(stop=stop))
    check(problem, plan)
    assert plan.certificate.proof is Proof.RELAXATION


def test_small_problems_do_not_load_the_solvers():
    code = (
        "import sys, numpy as np\n"
        "from planner import RoutingProblem, Shipment, solver\n"
        "d = np.array([[0.0, 3.0, 5.0], [3.0, 0.0, 4.0], [5.0, 4.0, 0.0]])\n"
        "solver('exact').solve(RoutingProblem(d, 0, (Shipment(1, 2),)))\n"
        "sys.exit(sum(name.startswith(('ortools', 'mujoco', 'scipy', 'numba')) for name in sys.modules))\n"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@given(seed=st.integers(0, 2**32 - 1), nodes=st.integers(2, 12))
def test_the_checker_walks_as_far_as_scipy(seed, nodes):
    """From the start, which is the node before the last one."""
    rng = np.random.default_rng(seed)
    lengths = np.where(rng.random((nodes, nodes)) < 0.4, rng.integers(1, 50, (nodes, nodes)), 0)
    tail, head = np.nonzero(lengths)
    found = _shortest_walks(tail, head, lengths[tail, head], nodes).astype(float)
    truth = shortest_path(csr_array(lengths), indices=nodes - 2)
    assert np.array_equal(np.where(found > 1e6, np.inf, found), truth)
