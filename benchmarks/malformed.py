"""10,000 hostile inputs of all commands: no traceback, nothing wrong in silence, nothing lost, nothing that hangs."""

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

from rich.console import Console
from rich.progress import track

from benchmarks.support.hostile_cases import case_factory
from benchmarks.support.requirements import Requirement, requirement_lines
from benchmarks.support.warm_commands import Outcome, run_cases

COUNT, QUICK = 10_000, 100
FAULTS = ("traceback", "silent wrong", "lost", "half-written", "hang", "died", "refused")  # how faults begin
REQUIREMENTS = (
    Requirement("tracebacks, and processes that died", "tracebacks", "<=", 0),
    Requirement("wrong without a word", "silent", "<=", 0),
    Requirement("files lost or half-written", "lost", "<=", 0),
    Requirement("hangs beyond 10 s", "hangs", "<=", 0),
    Requirement("refusals without reason or at length, and of what is good", "unclear", "<=", 0),
)


def measure(
    quick: bool = False, count: int | None = None, workers: int | None = None, only: int | None = None
) -> dict[str, Any]:
    """Run the benchmark; everything in it can be written as JSON.

    Args:
        quick: A hundred cases.
        count: How many cases.
        workers: Processes; one per core unless said.
        only: Run the case of this number alone, to look at a failure again.
    """
    numbers = range(count or (QUICK if quick else COUNT)) if only is None else range(only, only + 1)
    outcomes = run_cases(case_factory, numbers, workers or os.cpu_count() or 1)
    return summarise(list(track(outcomes, "cases", total=len(numbers), console=Console(stderr=True))))


def summarise(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """Counts by fault, by command and by kind, and the failures."""
    faults = Counter(next((f for f in FAULTS if o.fault.startswith(f)), o.fault) for o in outcomes)
    rows = Counter((o.command, o.kind.partition(":")[0], o.result) for o in outcomes)
    return {
        "benchmark": "malformed",
        "cases": len(outcomes),
        "tracebacks": faults["traceback"] + faults["died"],
        "silent": faults["silent wrong"],
        "lost": faults["lost"] + faults["half-written"],
        "hangs": faults["hang"],
        "unclear": faults["refused"],
        "slowest_s": max(o.seconds for o in outcomes),
        "rows": [
            {
                "command": command,
                "kind": kind,
                "refused": rows[command, kind, "refused"],
                "used": rows[command, kind, "used"],
            }
            for command, kind in dict.fromkeys(sorted(row[:2] for row in rows))
        ],
        "failures": [
            {
                "number": o.number,
                "command": o.command,
                "kind": o.kind,
                "line": o.line,
                "fault": o.fault,
                "output": o.output,
            }
            for o in sorted(outcomes, key=lambda o: (o.fault, o.number))
            if o.fault
        ],
    }


def lines(result: dict[str, Any]) -> Iterator[str]:
    """The result for people."""
    yield f"{'command':18}{'what is hostile':42}{'refused':>9}{'used':>7}"
    for row in result["rows"]:
        yield f"{row['command']:18}{row['kind'][:40]:42}{row['refused']:9}{row['used']:7}"
    for failure in result["failures"]:
        yield f"{failure['fault']}: {failure['kind']}; `mjsim bench malformed --only {failure['number']}` runs it again"
        yield f"    mjsim {failure['line'][:300]}"
        yield from (f"    {line[:300]}" for line in failure["output"].splitlines()[-6:])
    yield f"{result['cases']} cases; the slowest took {result['slowest_s']:.1f} s"
    yield from requirement_lines(result, REQUIREMENTS)
