"""Damaged houses, objects and episodes are used or refused in one line: no traceback, no crash, no hang."""

import multiprocessing

from benchmarks.malformed import lines, summarise
from benchmarks.support.malformed_sessions import REFUSED, USED, Outcome, _next, run_cases

CASES = 200  # `mjsim bench malformed` runs thousands


def test_damaged_files_are_used_or_refused_in_one_line() -> None:
    outcomes = list(run_cases(range(CASES)))
    assert [o.seed for o in outcomes] == list(range(CASES))
    assert not [o for o in outcomes if not o.good], [o for o in outcomes if not o.good]
    results = [o.result for o in outcomes]
    assert results.count(USED) > CASES // 20 and results.count(REFUSED) > CASES // 4


def test_a_process_that_hangs_or_dies_is_a_failure() -> None:
    ours, theirs = multiprocessing.Pipe()
    process = multiprocessing.get_context("spawn").Process(target=print)
    process.start()
    process.join()
    assert _next(ours, process, 0.05) == "hung for 0.05 s"
    theirs.close()
    assert _next(ours, process, 1.0) == "crashed with exit code 0"


def test_failures_are_named_with_their_seed() -> None:
    result = summarise([Outcome(0, "empty in house.xml", REFUSED, "no"), Outcome(7, "", "hung for 1 s")])
    assert result["results"] == {REFUSED: 1, "hung for 1 s": 1}
    assert any("seed 7" in line for line in lines(result))
