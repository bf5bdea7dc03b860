"""Mesh files of many kinds, imported, sampled and placed by the person's hands, in both tiers of fidelity."""

import functools
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.support.import_sessions import OWN, TIERS, import_all, run_session
from benchmarks.support.mesh_files import MESHES
from benchmarks.support.parallel_sessions import run_sessions
from benchmarks.support.placement_sessions import Placement
from benchmarks.support.requirements import Requirement, requirement_lines

COUNT, QUICK = 100, 6
REQUIREMENTS = (
    Requirement("imported meshes", "meshes", ">=", 20),
    Requirement("placements that were not delivered at the first try", "failed", "<=", 0),
    Requirement("objects of which fewer were tried than wanted", "untried", "<=", 0),
)


def measure(
    quick: bool = False, count: int | None = None, workers: int | None = None, only: int | None = None
) -> dict[str, Any]:
    """Run the benchmark; everything in it can be written as JSON.

    Args:
        quick: A few placements of each.
        count: Placements of each object in each tier, rounded up to whole sessions.
        workers: Processes; one per core unless said.
        only: Number of the one session to run, to look at a failure again.
    """
    wanted = count or (QUICK if quick else COUNT)
    with tempfile.TemporaryDirectory() as folder:
        extension = import_all(Path(folder))
        keys = sorted(set(extension.catalogue.objects) & set(MESHES))
        sessions = -(-wanted // OWN)
        run = functools.partial(run_session, keys=tuple(keys))
        found = run_sessions(
            run, sessions * len(keys) * len(TIERS), workers=workers, only=only, house=str(extension.path)
        )
    return summarise(keys, [placement for session in found for placement in session], wanted)


def summarise(keys: list[str], placements: list[tuple[str, Placement]], wanted: int) -> dict[str, Any]:
    """Figures over the placements of the objects `keys`, of each of which so many were wanted in each tier."""
    rows = []
    for key in keys:
        row: dict[str, Any] = {"name": key}
        for tier in TIERS:
            mine = [p for t, p in placements if t == tier and p.model == key]
            row[tier] = {"placed": sum(p.outcome == "placed" for p in mine), "tried": len(mine)}
        rows.append(row)
    failures = [(tier, p) for tier, p in placements if p.outcome != "placed"]
    return {
        "benchmark": "imports",
        "meshes": len(keys),
        "failed": len(failures),
        "untried": sum(row[tier]["tried"] < wanted for row in rows for tier in TIERS),
        "objects": rows,
        "failures": [
            {"session": p.session, "tier": tier, "model": p.model, "fill": p.fill, "outcome": p.outcome}
            for tier, p in failures
        ],
    }


def lines(result: dict[str, Any]) -> Iterator[str]:
    """The result for people."""
    yield f"{'imported object':24}" + "".join(f"{tier:>14}" for tier in TIERS)
    for row in result["objects"]:
        tries = "".join(f"{'{placed} of {tried}'.format(**row[tier]):>14}" for tier in TIERS)
        yield f"{row['name']:24}{tries}"
    for failure in result["failures"]:
        yield "failed in {tier}: {outcome} of {model} with {fill} before it (session {session})".format(
            **failure
        )
    yield from requirement_lines(result, REQUIREMENTS)
