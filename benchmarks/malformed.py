"""Damaged houses, objects and episodes: each is used, or refused in one line within a time limit."""

from collections import Counter
from typing import Any

from rich.console import Console
from rich.progress import track

from benchmarks.support.malformed_sessions import Outcome, run_cases

COUNT, QUICK = 2000, 100
SHOWN = 10


def measure(quick: bool = False, count: int | None = None, only: int | None = None) -> dict[str, Any]:
    """Run the benchmark; everything in it can be written as JSON.

    Args:
        quick: A few cases.
        count: How many cases.
        only: Seed of the one case to run, to look at a failure again.
    """
    seeds = range(count or (QUICK if quick else COUNT)) if only is None else range(only, only + 1)
    outcomes = list(track(run_cases(seeds), "cases", total=len(seeds), console=Console(stderr=True)))
    return summarise(outcomes)


def summarise(outcomes: list[Outcome]) -> dict[str, Any]:
    """Counts by result and by damage, and the failures."""
    damages = Counter(outcome.damage.split(" in ")[0] for outcome in outcomes)
    return {
        "cases": len(outcomes),
        "results": dict(Counter(outcome.result for outcome in outcomes)),
        "damages": dict(damages),
        "failures": [
            {"seed": o.seed, "damage": o.damage, "result": o.result, "message": o.message}
            for o in outcomes
            if not o.good
        ],
    }


def lines(result: dict[str, Any]) -> list[str]:
    """The result as text."""
    text = [
        f"{result['cases']} damaged files: " + ", ".join(f"{n} {r}" for r, n in result["results"].items())
    ]
    text += [f"  {count:5d}  {name}" for name, count in sorted(result["damages"].items())]
    for failure in result["failures"][:SHOWN]:
        text.append(f"seed {failure['seed']}, {failure['damage']}: {failure['result']}")
        text += [f"    {line[:200]}" for line in failure["message"].splitlines()[-4:]]
    return text
