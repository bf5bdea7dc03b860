"""`mjsim plan`: problems in JSON, plans in JSON, faults in one line."""

import itertools
import json
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from experiments.cli.main import main

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


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        ("no/such/file.json", "no/such/file.json"),
        ("- --check -", "standard input"),
        *(
            (f"problem.json --time-limit={limit}", "must be positive and finite")
            for limit in (0, -1, "nan", "inf")
        ),
    ],
)
def test_words_that_make_no_sense_are_named(words, fault, capsys):
    assert main(["plan", *words.split()]) == 2
    assert fault in capsys.readouterr().err


def test_a_limit_too_short_for_any_planner_still_gives_a_tour(tmp_path, capsys):
    code, printed = plan(tmp_path, capsys, scattered(30), "--time-limit", "0.02")
    answer = json.loads(printed.out)
    assert (code, answer["status"]) == (0, "feasible")
    assert len(answer["visits"]) == 61


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_planning_with_the_best_tour_so_far(number):
    command = [sys.executable, "-m", "experiments.cli.main", "plan", "-", "--time-limit", "100"]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    process.stdin.write(json.dumps(scattered(80)))  # more than a pipe holds: from here on it is reading
    process.stdin.flush()
    process.stdin.close()
    process.stdin = None
    time.sleep(2.0)  # a first tour takes milliseconds, but the machine may be busy
    process.send_signal(number)
    asked = time.monotonic()
    out, err = process.communicate(timeout=60)
    assert time.monotonic() - asked < 5
    assert process.returncode == 128 + number
    assert json.loads(out)["status"] == "feasible"
    assert "best tour so far" in err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "reason"), [({"capacity": 3}, "capacity of 3"), ({}, "more than 60"), (None, "triangle")]
)
def test_a_plan_of_or_tools_says_that_it_is_not_proven(tmp_path, capsys, change, reason):
    problem = scattered(61 if change == {} else 5) | (change or {})
    if change is None:
        problem["distances"][1][9] = problem["distances"][9][1] = 100.0
    code, printed = plan(tmp_path, capsys, problem, "--time-limit", "1")
    assert (code, json.loads(printed.out)["status"]) == (0, "feasible")
    assert "planned by OR-Tools, not proven" in printed.err and reason in printed.err


def claimed(tmp_path, capsys, problem, *options):
    """Problem and certificate as files, and what the certificate says."""
    claim = tmp_path / "claim.json"
    code, printed = plan(tmp_path, capsys, problem, "--certificate", str(claim), *options)
    assert code == 0
    assert set(json.loads(printed.out)) == {"visits", "cost", "lower_bound", "status", "seconds"}
    return claim, json.loads(claim.read_text())


def test_a_certificate_does_not_replace_the_problem(tmp_path, capsys):
    code, printed = plan(
        tmp_path, capsys, PROBLEM, "--certificate", str(tmp_path / "problem.json"), "--force"
    )
    assert code == 2 and "problem.json is the problem" in printed.err


def checked(tmp_path, capsys, claim):
    code = main(["plan", str(tmp_path / "problem.json"), "--check", str(claim)])
    return code, capsys.readouterr()


def scattered(count):
    places = np.random.default_rng(count).uniform(0, 10, (5 + count, 2))
    distances = np.linalg.norm(places[:, None] - places[None], axis=2)
    shipments = [{"pickup": 5 + k, "delivery": 1 + k % 4} for k in range(count)]
    return {"distances": distances.tolist(), "shipments": shipments, "onboard": [2]}


@pytest.mark.parametrize(
    ("problem", "planner"),
    [
        (PROBLEM, "exact"),
        (scattered(20), "exact"),
        (scattered(9), "ortools"),
        (scattered(0), "exact"),
    ],
)
def test_a_certificate_is_verified_from_its_files_alone(tmp_path, capsys, problem, planner):
    limit = ("--time-limit", "0.3") if planner == "ortools" else ()
    claim, written = claimed(tmp_path, capsys, problem, "--planner", planner, *limit)
    code, printed = checked(tmp_path, capsys, claim)
    answer = json.loads(printed.out)
    assert (code, answer["holds"]) == (0, True)
    assert (answer["cost"], answer["lower_bound"]) == (written["cost"], written["lower_bound"])
    assert 0 <= answer["verified_bound"] <= answer["cost"]
    if planner == "exact":
        assert answer["verified_bound"] == pytest.approx(answer["cost"], rel=1e-8)
        assert (answer["verified_optimal"], answer["unverified"]) == (True, "")


def test_a_planner_that_gives_nothing_in_time_is_not_said_to_have_planned(tmp_path, capsys, own_module):
    own_module("import time\nclass Own:\n    def solve(self, problem, **_): time.sleep(2)")
    (tmp_path / "problem.json").write_text(json.dumps(scattered(3)))
    words = ["plan", str(tmp_path / "problem.json"), "--planner", "own_code:Own", "--time-limit", "0.2"]
    assert main(words) == 0
    assert "own_code:Own gave no plan in time" in capsys.readouterr().err


PROOF = {"proof": "full-table", "unit": 1.0, "groups": [], "multipliers": []}


def test_a_forged_claim_exits_with_one_and_says_why(tmp_path, capsys):
    claim, written = claimed(tmp_path, capsys, scattered(9))
    claim.write_text(json.dumps({**written, "visits": written["visits"][:-1]}))
    code, printed = checked(tmp_path, capsys, claim)
    answer = json.loads(printed.out)
    assert (code, answer["holds"], printed.err) == (1, False, "")
    assert "never done" in answer["fault"]


def fault_of(folder, capsys, name, document):
    """The one line that refuses a problem or a claim."""
    path = folder / f"{name}.json"
    path.write_text(json.dumps(document))
    check = ("--check", str(path)) if name == "claim" else ()
    assert main(["plan", str(folder / "problem.json"), *check]) == 2
    printed = capsys.readouterr()
    assert (printed.out, len(printed.err.splitlines())) == ("", 1)
    assert path.name in printed.err
    return printed.err


@pytest.mark.parametrize(
    ("name", "change", "fault"),
    [
        ("problem", {"distances": [[0, 1], [1, 0], [2, 2]]}, "must be square"),
        ("problem", {"distances": [[0, 1, 2], [1, 0], [2, 1, 0]]}, "row 1 has 2 of 3"),
        ("problem", {"distances": [[0, 3, 5], [2, 0, 4], [5, 4, 0]]}, "make it symmetric"),
        ("problem", {"distances": [[0, None]]}, "Expected `float`, got `null` - at `$.distances[0][1]`"),
        ("problem", {"distances": []}, "square matrix"),
        ("problem", {"start": 3}, "start 3 is out of range for 3 locations"),
        ("problem", {"shipments": [{"pickup": 1}]}, "required field `delivery` - at `$.shipments[0]`"),
        ("problem", {"onbaord": []}, "unknown field `onbaord`"),
        ("claim", {"visits": [["pick", 9]]}, "visits[0] has the number 9, but the problem has 1 to pick"),
        ("claim", {"visits": [["place onboard", -1]]}, "number -1"),
        ("claim", {"visits": [["throw", 1]]}, "Invalid enum value 'throw' - at `$.visits[0][0]`"),
        ("claim", {"status": "perfect"}, "Invalid enum value 'perfect' - at `$.status`"),
        ("claim", {"format": 1}, "Invalid enum value 1 - at `$.format`"),
        ("claim", {"certificate": PROOF | {"root": 10**400}}, "$.certificate.root"),
        (
            "claim",
            {"certificate": PROOF | {"root": 1, "more": 1}},
            "unknown field `more` - at `$.certificate`",
        ),
        (
            "claim",
            {"certificate": {"proof": "full-table", "unit": 1.0, "root": 1}},
            "required field `groups`",
        ),
        ("claim", {"more": 1}, "unknown field `more`"),
    ],
)
def test_a_malformed_document_exits_with_two_and_one_line(tmp_path, capsys, name, change, fault):
    _, written = claimed(tmp_path, capsys, PROBLEM)
    document = written if name == "claim" else PROBLEM
    assert fault in fault_of(tmp_path, capsys, name, {**document, **change})


def test_values_of_other_types_are_named_with_their_path(tmp_path, capsys):
    _, written = claimed(tmp_path, capsys, PROBLEM)
    for name, document in (("claim", written), ("problem", PROBLEM)):
        for field, value in itertools.product(document, (None, True, 0.5, "x", [0.5], {})):
            same = type(value) is type(document[field]) and value != [0.5]
            if not same and (field, value) != ("certificate", None):
                fault = fault_of(tmp_path, capsys, name, {**document, field: value})
                assert f"- at `$.{field}" in fault and f"`; a {name} is" in fault


LOADS = """
import json, sys
from experiments.cli.main import main
assert main(["plan", sys.argv[1]]) == 0
heavy = {"gymnasium", "llvmlite", "matplotlib", "mujoco", "networkx", "numba", "ortools", "scipy", "shapely"}
heavy |= {"OpenGL", "cv2", "hud", "sqlalchemy", "starlette", "uvicorn"}
print(json.dumps(sorted(heavy & set(sys.modules))))
"""


@pytest.mark.parametrize(
    ("objects", "allowed"),
    [(12, set()), (16, {"llvmlite", "numba", "scipy"}), (26, {"llvmlite", "numba", "ortools", "scipy"})],
)
def test_a_fresh_process_loads_no_more_than_it_takes_to_plan(tmp_path, objects, allowed):
    """To load a library takes longer than to plan; numba, which brings scipy, pays from about 15 objects on."""
    path = tmp_path / "problem.json"
    path.write_text(json.dumps(scattered(objects)))
    ran = subprocess.run([sys.executable, "-c", LOADS, str(path)], capture_output=True, text=True, check=True)
    answer, loaded = map(json.loads, ran.stdout.splitlines())
    assert answer["status"] == "optimal"
    assert set(loaded) <= allowed
