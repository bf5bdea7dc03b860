"""`mjsim plan`: problems in JSON, plans in JSON, faults in one line."""

import itertools
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.cli import main
from planner.errors import ProblemError
from planner.problem_json import plan_to_json, problem_from_json
from planner.solver import solver

PROBLEM = {
    "capacity": 2,
    "start": 0,
    "distances": [[0, 3, 5], [3, 0, 4], [5, 4, 0]],
    "shipments": [{"pickup": 1, "delivery": 2}],
    "onboard": [2],
}


def plan(tmp_path, capsys, problem, *options):
    path = tmp_path / "problem.json"
    path.write_text(problem if isinstance(problem, str) else json.dumps(problem))
    code = main(["plan", str(path), *options])
    return code, capsys.readouterr()


@pytest.mark.parametrize("planner", ["exact", "ortools"])
def test_the_problem_of_the_help_text(tmp_path, capsys, planner):
    code, printed = plan(tmp_path, capsys, PROBLEM, "--planner", planner)
    answer = json.loads(printed.out)
    assert code == 0
    # Fetch on the way, drop both at once: 3 + 4 + 0.
    assert answer["visits"] == [1, 2, 2]
    assert (answer["cost"], answer["lower_bound"], answer["status"]) == (7.0, 7.0, "optimal")
    assert answer["seconds"] >= 0


def test_nothing_to_do_is_a_plan(tmp_path, capsys):
    code, printed = plan(tmp_path, capsys, {"distances": [[0]], "shipments": []})
    assert code == 0
    assert json.loads(printed.out)["visits"] == []


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"distances": [[0, 1], [1, 0], [2, 2]]}, "must be square"),
        ({"distances": [[0, 1, 2], [1, 0], [2, 1, 0]]}, "row 1 has 2 of 3"),
        ({"distances": [[0, -3, 5], [-3, 0, 4], [5, 4, 0]]}, "distances[0][1] is -3.0"),
        ({"distances": [[0, 3, 5], [2, 0, 4], [5, 4, 0]]}, "make it symmetric"),
        ({"distances": [[1, 3, 5], [3, 0, 4], [5, 4, 0]]}, "the diagonal must be 0"),
        (
            {"distances": [[0, None, 5], [3, 0, 4], [5, 4, 0]]},
            "distances[0][1] must be a finite number, got null",
        ),
        ({"distances": 7}, "distances must be a list, got a number"),
        ({"distances": []}, "square matrix"),
        ({"start": 3}, "start 3 is out of range for 3 locations"),
        ({"start": -1}, "start -1 is out of range"),
        ({"start": 0.5}, "start must be a whole number, got 0.5"),
        ({"shipments": [{"pickup": 9, "delivery": 2}]}, "pickup 9 is out of range"),
        ({"shipments": [{"pickup": 1}]}, "shipments[0] must be"),
        ({"shipments": None}, "shipments must be a list, got null"),
        ({"onboard": [2, 2, 1]}, "3 objects are onboard but the capacity is 2"),
        ({"onboard": [8]}, "onboard 8 is out of range"),
        ({"capacity": 0}, "capacity must be at least 1"),
        ({"capacity": True}, "capacity must be a whole number"),
        ({"onbaord": []}, "unknown field 'onbaord'"),
    ],
)
def test_a_malformed_problem_exits_with_two_and_one_line(tmp_path, capsys, change, fault):
    code, printed = plan(tmp_path, capsys, {**PROBLEM, **change})
    assert code == 2
    assert printed.out == ""
    assert len(printed.err.strip().splitlines()) == 1
    assert fault in printed.err
    assert "problem.json" in printed.err


@pytest.mark.parametrize("text", ["", "{", "[1, 2]", '{"distances": [[NaN]], "shipments": []}'])
def test_what_is_no_problem_at_all(tmp_path, capsys, text):
    code, printed = plan(tmp_path, capsys, text)
    assert (code, printed.out, len(printed.err.strip().splitlines())) == (2, "", 1)


def test_a_missing_file_is_named(capsys):
    assert main(["plan", "no/such/file.json"]) == 2
    assert "no/such/file.json" in capsys.readouterr().err


def test_a_time_limit_must_be_positive(tmp_path, capsys):
    code, printed = plan(tmp_path, capsys, PROBLEM, "--time-limit", "0")
    assert code == 2
    assert "must be positive" in printed.err


@st.composite
def problems(draw):
    """Up to three objects, any capacity, coinciding places, some already carried; in the plane or no metric at all."""
    count = draw(st.integers(1, 6))
    if draw(st.booleans()):
        coordinate = st.tuples(st.integers(0, 8), st.integers(0, 8))
        points = np.array([draw(coordinate) for _ in range(count)], dtype=float)
        distances = np.linalg.norm(points[:, None] - points[None], axis=2)
    else:
        entries = draw(st.lists(st.integers(0, 30), min_size=count**2, max_size=count**2))
        distances = np.triu(np.reshape(np.array(entries, dtype=float), (count, count)), 1)
        distances += distances.T
    index = st.integers(0, count - 1)
    capacity = draw(st.integers(1, 4))
    return {
        "capacity": capacity,
        "start": draw(index),
        "distances": distances.tolist(),
        "shipments": draw(st.lists(st.fixed_dictionaries({"pickup": index, "delivery": index}), max_size=3)),
        "onboard": draw(st.lists(index, max_size=min(capacity, 1))),
    }


def brute_force(problem):
    """Length of the best open tour, by trying every order of all visits."""
    d = np.array(problem["distances"])
    n = len(problem["shipments"])
    stops = [(s["pickup"], s["delivery"]) for s in problem["shipments"]]
    visits = [("pick", k, stops[k][0]) for k in range(n)] + [("drop", k, stops[k][1]) for k in range(n)]
    visits += [("carried", k, j) for k, j in enumerate(problem["onboard"])]
    best = np.inf
    for order in itertools.permutations(visits):
        load, picked, here, length = len(problem["onboard"]), set(), problem["start"], 0.0
        for kind, k, place in order:
            load += 1 if kind == "pick" else -1
            if load > problem["capacity"] or (kind == "drop" and k not in picked):
                break
            picked |= {k} if kind == "pick" else set()
            length += d[here, place]
            here = place
        else:
            best = min(best, length)
    return best


@settings(max_examples=80, deadline=None)
@given(problems())
def test_plans_cost_what_brute_force_finds(problem):
    answer = json.loads(plan_to_json(solver("exact").solve(problem_from_json(json.dumps(problem)))))
    assert answer["cost"] == pytest.approx(brute_force(problem), abs=1e-3)
    assert answer["status"] == "optimal"


def test_numbers_are_not_silently_truncated():
    with pytest.raises(ProblemError, match="whole number"):
        problem_from_json(json.dumps({**PROBLEM, "onboard": [1.9]}))
